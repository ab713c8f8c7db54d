//! A node with its storage task: the copy of a job, its run and its end are steps of their own, and requests of the client
//! come in between.

use canopen::{Action, Duration, Frame, Instant, Next};
use host_tests::bench::{ERASE, ID, PAGES, Queue, intact, raw, setup};
use node::{EraseBudget, Measurement, ParameterMemory, Personality, Protocol, Setup, StoreJob};
use profiles::board::{Inputs, PowerOn, RawEncoder, Retained};
use storage::View;

use super::chip::Chip;

/// The abort codes that a refusal may have.
pub(super) const DEVICE_STATE: u32 = 0x0800_0022;
/// The client gives up after this time in milliseconds.
const TIME_OUT: u32 = 1000;

/// An object: index and sub-index.
pub(super) type Object = (u16, u8);

/// The board.
pub(super) struct Board {
    setup: Setup,
    pub(super) chip: Chip,
    protocol: Protocol,
    measurement: Measurement,
    memory: Option<ParameterMemory<Chip>>,
    job: StoreJob,
    /// The storage task has copied a job and not yet run it.
    is_copied: bool,
    /// `Action::Store` was handed over, or the services asked for the storage task.
    is_pended: bool,
    out: Queue,
    pub(super) now: Instant,
    has_parameters: bool,
}

impl Board {
    pub(super) fn new(personality: Personality, seed: u64) -> Board {
        let setup = Setup { personality, ..setup() };
        let mut board = Board {
            setup,
            chip: Chip::new(seed),
            protocol: Protocol::new(&setup),
            measurement: Measurement::new(personality, &intact()),
            memory: None,
            job: StoreJob::new(personality),
            is_copied: false,
            is_pended: false,
            out: Queue::default(),
            now: Instant(0),
            has_parameters: false,
        };
        board.start(Retained::Nothing, EraseBudget::new(None));
        board
    }

    /// The power returns: the erase budget is full again.
    pub(super) fn power_cycle(&mut self) {
        self.chip.power_up();
        self.start(self.measurement.retained(), EraseBudget::new(None));
    }

    /// A reset: the erase budget survives.
    pub(super) fn reset(&mut self) {
        let left = self.memory.as_ref().map(|memory| memory.budget().word());
        self.start(self.measurement.retained(), EraseBudget::new(left));
    }

    fn start(&mut self, retained: Retained, budget: EraseBudget) {
        self.memory = None;
        (self.is_copied, self.is_pended, self.now) = (false, false, Instant(0));
        self.out.0.clear();
        // A power cut during the start begins the start again.
        while self.memory.is_none() {
            if self.chip.is_down() {
                self.chip.power_up();
            }
            let mut view = View::open(self.chip.clone(), PAGES).expect("there is power");
            self.protocol = Protocol::new(&self.setup);
            self.protocol.load(&mut view);
            self.memory = ParameterMemory::prepare(view, budget).ok();
        }
        self.show_memory();
        let power_on = PowerOn { retained, ..intact() };
        self.measurement = Measurement::new(self.setup.personality, &power_on);
        self.measurement.apply(&self.protocol.parameters());
        let next = self.protocol.start(self.now, &mut self.out);
        self.keep(next);
        self.run(5);
    }

    fn show_memory(&mut self) {
        let state = self.memory.as_ref().expect("a store").state();
        self.protocol.show_memory(state);
    }

    fn keep(&mut self, next: Next) {
        self.has_parameters |= next.parameters;
        self.is_pended |= matches!(next.action, Some(Action::Store(_)));
    }

    /// Milliseconds pass, in each of which the storage task does one step.
    pub(super) fn run(&mut self, milliseconds: u32) {
        for _ in 0..milliseconds {
            self.now = self.now + Duration::from_millis(1);
            self.sample();
            self.poll();
            self.store();
        }
    }

    /// Much time passes without samples.
    pub(super) fn wait(&mut self, span: Duration) {
        self.now = self.now + span;
        self.poll();
        self.store();
        self.out.0.clear();
    }

    fn sample(&mut self) {
        if std::mem::take(&mut self.has_parameters) {
            self.measurement.apply(&self.protocol.parameters());
        }
        let inputs =
            Inputs { analogue: raw(250_000.0, 298.15), position: RawEncoder::default(), digital: [false; 2] };
        self.measurement.update(&inputs, self.protocol.snapshot_mut());
        let next = self.protocol.publish(self.now, &mut self.out);
        // The process task wakes the services, which wake the storage task.
        self.is_pended |= next.services <= self.now;
    }

    fn poll(&mut self) {
        for _ in 0..4 {
            let next = self.protocol.poll_services(self.now, &mut self.out);
            self.keep(next);
        }
    }

    /// One step of the storage task.
    fn store(&mut self) {
        if self.chip.is_down() {
            return;
        }
        if self.is_copied {
            self.is_copied = false;
            let result = self.memory.as_mut().expect("a store").run(&mut self.job);
            self.keep_room();
            if !self.chip.is_down() {
                let _ = self.protocol.finish(&self.job, result, self.now, &mut self.out);
            }
        } else if std::mem::take(&mut self.is_pended) && self.protocol.take_job(&mut self.job) {
            self.is_copied = true;
        } else {
            self.keep_room();
        }
    }

    fn keep_room(&mut self) {
        let memory = self.memory.as_mut().expect("a store");
        if memory.can_make_room(self.now) && self.protocol.can_pause(ERASE, self.now) {
            let _ = memory.make_room();
        }
        self.show_memory();
    }

    /// An NMT command.
    pub(super) fn nmt(&mut self, command: u8) {
        let frame = Frame::new(0, &[command, ID]).expect("a frame");
        let _ = self.protocol.on_process_frame(&frame, self.now, &mut self.out);
        self.poll();
    }

    /// Sends a request of the SDO client, who does not wait.
    pub(super) fn send(&mut self, command: u8, (index, sub): Object, value: u32) {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        let frame =
            Frame::new(0x600 + u16::from(ID), &[command, low, high, sub, a, b, c, d]).expect("a frame");
        self.out.0.clear();
        let next = self.protocol.on_service_frame(&frame, self.now, &mut self.out);
        self.keep(next);
        self.poll();
    }

    /// Whether a response has arrived.
    pub(super) fn has_response(&self) -> bool {
        self.first_response().is_some()
    }

    /// The abort code of the response that has arrived, if it is an abort.
    pub(super) fn refusal(&self) -> Option<u32> {
        decoded(&self.out.0[self.first_response()?]).err()
    }

    fn first_response(&self) -> Option<usize> {
        self.out.0.iter().position(|frame| frame.id() == 0x580 + u16::from(ID))
    }

    /// Takes the response that has arrived.
    fn response(&mut self) -> Option<Result<u32, u32>> {
        let place = self.first_response()?;
        Some(decoded(&self.out.0.remove(place)))
    }

    /// Waits for the response; `None` after a power cut.
    pub(super) fn wait_for_response(&mut self) -> Option<Result<u32, u32>> {
        for _ in 0..TIME_OUT {
            if let Some(response) = self.response() {
                return Some(response);
            }
            if self.chip.is_down() {
                return None;
            }
            self.run(1);
        }
        panic!("no response within {TIME_OUT} ms");
    }

    pub(super) fn read(&mut self, object: Object) -> u32 {
        self.send(0x40, object, 0);
        self.wait_for_response().expect("power").unwrap_or_else(|code| panic!("{object:x?}: {code:08x}"))
    }

    /// Writes a value of `size` bytes that is not stored at once.
    pub(super) fn write(&mut self, object: Object, size: u8, value: u32) -> Result<u32, u32> {
        self.send(0x23 | (4 - size) << 2, object, value);
        self.response().expect("an answer at once")
    }
}

/// The value, or the abort code.
fn decoded(frame: &Frame) -> Result<u32, u32> {
    let &[command, _, _, _, a, b, c, d] = frame.data() else { panic!("eight bytes") };
    let value = u32::from_le_bytes([a, b, c, d]);
    let unused = if command & 0xE1 == 0x41 { 8 * u32::from(command >> 2 & 3) } else { 0 };
    if command == 0x80 { Err(value) } else { Ok(value << unused >> unused) }
}
