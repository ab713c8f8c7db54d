//! The node of this project on the simulated bus, with its parameter store.

use canopen::{Action, Frame, Instant, Next, NodeId, Transmit};
use node::{BitRate, Personality, Protocol, Setup, StoreJob};
use nodectl::bus::Station;
use storage::{Memory, Pages, Store, View};

const PAGES: Pages = Pages::new(0, 4096);

/// A pressure transmitter. It starts at the first poll and restarts on command.
pub(crate) struct Pressure {
    setup: Setup,
    protocol: Protocol,
    store: Store<Memory<Vec<u8>>>,
    is_started: bool,
}

impl Pressure {
    /// A node as delivered; with `None` it has no node-ID and waits for LSS.
    pub(crate) fn new(id: impl Into<Option<u8>>) -> Pressure {
        Pressure::of(Personality::Pressure, id)
    }

    /// The same node with another personality.
    pub(crate) fn of(personality: Personality, id: impl Into<Option<u8>>) -> Pressure {
        let setup = Setup {
            personality,
            node_id: id.into().and_then(NodeId::new),
            bit_rate: BitRate::from_kbit(250).expect("a bit rate"),
            serial_number: 0x1234_5678,
            program_id: 0x0BAD_CAFE,
            hardware_version: "in process",
            software_version: "1.2.3",
        };
        Pressure::with_flash(setup, vec![0xFF; 8192])
    }

    /// The same node with another serial number.
    pub(crate) fn with_serial(self, serial_number: u32) -> Pressure {
        Pressure::with_flash(Setup { serial_number, ..self.setup }, self.store.into_flash().0)
    }

    fn with_flash(setup: Setup, flash: Vec<u8>) -> Pressure {
        let mut view = View::open(Memory(flash), PAGES).expect("pages");
        let record = view.device().expect("a record or none");
        // Values that LSS has stored have priority over the factory values.
        let stored = record.map_or(setup, |record| Setup {
            node_id: NodeId::new(record.node_id()),
            bit_rate: BitRate::from_kbit(record.bit_rate_kbit()).expect("a bit rate"),
            ..setup
        });
        let mut protocol = Protocol::new(&stored);
        protocol.load(&mut view);
        let store = Store::prepare(view).expect("a store");
        Pressure { setup, protocol, store, is_started: false }
    }

    fn restart(&mut self) {
        let view = View::open(Memory(vec![0xFF; 8192]), PAGES).expect("pages");
        let empty = Store::prepare(view).expect("a store");
        let flash = std::mem::replace(&mut self.store, empty).into_flash().0;
        *self = Pressure::with_flash(self.setup, flash);
    }

    fn follow(&mut self, mut next: Next, now: Instant, out: &mut impl Transmit) -> Instant {
        while let Some(action) = next.action {
            match action {
                Action::ResetNode => self.restart(),
                Action::ResetCommunication => self.is_started = false,
                Action::Store(_) => self.save(now, out),
                Action::Identifiers | Action::BitRate(_) | Action::Bootloader => (),
            }
            next = self.protocol.poll_services(now, out);
        }
        next.services
    }

    fn save(&mut self, now: Instant, out: &mut impl Transmit) {
        let mut job = StoreJob::new(Personality::default());
        // As in the firmware, a job may have to wait for the values of new parameters.
        let is_taken = (0..4).any(|_| {
            let is_taken = self.protocol.take_job(&mut job);
            if !is_taken {
                let _ = self.protocol.publish(now, out);
            }
            is_taken
        });
        if is_taken {
            let result = job.run(&mut self.store);
            let _ = self.protocol.finish(&job, result, now, out);
        }
    }
}

impl Station for Pressure {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        if self.protocol.process_ids().any(|id| id == frame.id()) {
            let _ = self.protocol.on_process_frame(frame, now, out);
        }
        if self.protocol.service_ids().any(|id| id == frame.id()) {
            let next = self.protocol.on_service_frame(frame, now, out);
            self.follow(next, now, out);
        }
        let next = self.protocol.poll_services(now, out);
        self.follow(next, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if !std::mem::replace(&mut self.is_started, true) {
            let next = self.protocol.start(now, out);
            self.follow(next, now, out);
        }
        let process = self.protocol.poll_process(now, out).process;
        let next = self.protocol.poll_services(now, out);
        process.min(self.follow(next, now, out))
    }
}
