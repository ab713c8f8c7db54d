//! A node with its parameter store on a bench, without a bus: a test passes frames in and out, and controls the time.

use canopen::sdo::Multiplexer;
use canopen::{Action, Duration, Frame, Instant, Next, NodeId, QueueFull, Transmit};
use embedded_storage::nor_flash::NorFlash;
use monitor::{Incident, Sender};
use node::{
    BitRate, BusEvent, EraseBudget, Fault, Identity, Measurement, ParameterMemory, Personality, Protocol,
    Setup, StoreJob,
};
use profiles::board::{ChipThermometer, Inputs, PowerOn, RawEncoder, RawSample};
use std::collections::VecDeque;
use storage::{DeviceRecord, Memory, Pages, View};

use crate::sdo::{Channel, Client, Failure};
use crate::watch::{Answers, Watch, sheet};

/// Node-ID of the node on the bench.
pub const ID: u8 = 0x21;

/// A transmit queue that keeps all frames: for the test, and for the monitor.
#[derive(Debug, Default)]
pub struct Queue(pub Vec<Frame>, Vec<Frame>);

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        self.1.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

/// A node with both halves.
#[derive(Debug)]
pub struct Bench {
    /// The CANopen half.
    pub protocol: Protocol,
    /// The sampling half.
    pub measurement: Measurement,
    /// The sent frames.
    pub out: Queue,
    /// The current time.
    pub now: Instant,
    /// The parameter store.
    pub store: Flash,
    /// The readings of the encoder.
    pub encoder: RawEncoder,
    /// The buttons that are pressed.
    pub buttons: [bool; 2],
    /// The setup of a node without a stored device record.
    setup: Setup,
    actions: VecDeque<Action>,
    has_parameters: bool,
    /// The fault of the device record, if any.
    boot_data: Option<&'static Fault>,
    watch: Watch,
    /// The deadline of the last poll.
    due: Instant,
    /// Store jobs wait for [`begin_store`](Bench::begin_store); otherwise they are carried out at once.
    pub stores_later: bool,
}

/// The parameter store in RAM.
pub type Flash = ParameterMemory<Memory<Vec<u8>>>;

/// The pages of the board (memory.x).
pub const PAGES: Pages = Pages::new(0, 16 * 1024);
static ERASED: [u8; 32 * 1024] = [0xFF; 32 * 1024];
/// The longest time for which the erase of a page stops the core.
pub const ERASE: Duration = Duration::from_millis(500);

/// A setup with recognisable values.
#[must_use]
pub fn setup() -> Setup {
    Setup {
        personality: Personality::Pressure,
        node_id: NodeId::new(ID),
        bit_rate: BitRate::from_kbit(250).expect("a bit rate"),
        program_id: 0x0BAD_CAFE,
        serial_number: 0x1234_5678,
        hardware_version: "NUCLEO-F446RE",
        software_version: "0.1.0",
    }
}

/// A chip whose temperature sensor reads 940 at 30 degC and 1210 at 110 degC, with the reference at 1500.
pub const CHIP: ChipThermometer =
    ChipThermometer { offset: 303.15 - 940.0 * 80.0 / 270.0, slope: 1500.0 * 80.0 / 270.0 };

/// The readings of an intact sensor at this pressure in Pa and temperature in K: sums of 16 conversions at VDDA = 3.3
/// V.
#[must_use]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub fn raw(pascal: f64, kelvin: f64) -> RawSample {
    let supply = 16 * 4000;
    let ratio = 0.1 + 0.8 * pascal / 1.0e6;
    let temperature = 940.0 + (kelvin - 303.15) * (1210.0 - 940.0) / 80.0;
    RawSample {
        pressure: (ratio * f64::from(supply)).round() as u32,
        supply,
        temperature: (16.0 * temperature).round() as u32,
        reference: 16 * 1500,
        thermistor: 0,
        count: 16,
    }
}

/// The setup from the stored device record, as the firmware reads it.
fn stored_setup(record: DeviceRecord, unless_stored: &Setup) -> Setup {
    Setup {
        personality: Personality::numbered(record.personality()).expect("a personality"),
        node_id: NodeId::new(record.node_id()),
        bit_rate: BitRate::from_kbit(record.bit_rate_kbit()).expect("a bit rate"),
        ..*unless_stored
    }
}

/// The power-on state of a new board.
#[must_use]
pub fn intact() -> PowerOn {
    PowerOn { thermometer: CHIP, ..PowerOn::default() }
}

/// An empty parameter store.
///
/// # Panics
/// When the store cannot be prepared.
#[must_use]
pub fn empty_store() -> Flash {
    let view = View::open(Memory(ERASED.to_vec()), PAGES).expect("pages");
    ParameterMemory::prepare(view, EraseBudget::new(None)).expect("a store")
}

/// The store job that the node requests; `None` without a request.
///
/// As in the firmware, a job may wait for the values of new parameters, which come with the next samples.
pub fn take_job(protocol: &mut Protocol, now: Instant, out: &mut impl Transmit) -> Option<StoreJob> {
    let mut job = StoreJob::new(Personality::default());
    for _ in 0..4 {
        if protocol.take_job(&mut job) {
            return Some(job);
        }
        let _ = protocol.publish(now, out);
    }
    None
}

/// Carries out the store job of the node at once.
pub fn run_job(protocol: &mut Protocol, store: &mut Flash, now: Instant, out: &mut impl Transmit) {
    if let Some(mut job) = take_job(protocol, now, out) {
        let result = store.run(&mut job);
        keep_room(protocol, store, now);
        let _ = protocol.finish(&job, result, now, out);
    }
}

/// Erases a page if one is used up and a pause disturbs no service, and reports the state of the memory.
pub fn keep_room<F: NorFlash>(protocol: &mut Protocol, store: &mut ParameterMemory<F>, now: Instant) {
    if store.can_make_room(now) && protocol.can_pause(ERASE, now) {
        let _ = store.make_room();
    }
    protocol.show_memory(store.state());
}

impl Bench {
    /// A node that has booted; its boot-up message is already taken.
    #[must_use]
    pub fn booted() -> Bench {
        Bench::booted_as(Personality::Pressure)
    }

    /// A node of this personality that has booted.
    #[must_use]
    pub fn booted_as(personality: Personality) -> Bench {
        Bench::new_with(&Setup { personality, ..setup() }, intact())
    }

    /// A node with an empty parameter store.
    fn new_with(setup: &Setup, power_on: PowerOn) -> Bench {
        let mut watch = Watch::without_bus();
        watch.monitor().set_sheet(0, sheet(setup.personality), true);
        Bench::start(ERASED.to_vec(), setup, power_on, watch)
    }

    /// A node of this personality and node-ID that has booted.
    #[must_use]
    pub fn booted_at(personality: Personality, node_id: u8) -> Bench {
        let setup = Setup { personality, node_id: NodeId::new(node_id), ..setup() };
        Bench::new_with(&setup, intact())
    }

    /// The node-ID, as the number that is added to a function code.
    #[must_use]
    pub fn id(&self) -> u16 {
        self.protocol.node_id().map_or(0, NodeId::get).into()
    }

    /// A node that has booted with this content of its parameter pages.
    #[must_use]
    pub fn with_flash(flash: Vec<u8>) -> Bench {
        let mut watch = Watch::without_bus();
        watch.monitor().set_sheet(0, sheet(setup().personality), false);
        Bench::start(flash, &setup(), intact(), watch)
    }

    /// A node that has booted on a chip whose temperature sensor was not calibrated.
    #[must_use]
    pub fn booted_without_chip_calibration() -> Bench {
        Bench::new_with(&setup(), PowerOn::default())
    }

    fn start(flash: Vec<u8>, unless_stored: &Setup, power_on: PowerOn, watch: Watch) -> Bench {
        let mut view = View::open(Memory(flash), PAGES).expect("pages");
        let Identity { record, fault } = Identity::read(&mut view);
        let setup = record.map_or(*unless_stored, |record| stored_setup(record, unless_stored));
        let mut protocol = Protocol::new(&setup);
        protocol.load(&mut view);
        let mut bench = Bench {
            protocol,
            measurement: Measurement::new(setup.personality, &power_on),
            out: Queue::default(),
            now: Instant(0),
            store: ParameterMemory::prepare(view, EraseBudget::new(None)).expect("a store"),
            encoder: RawEncoder::default(),
            buttons: [false; 2],
            setup: *unless_stored,
            actions: VecDeque::new(),
            has_parameters: true,
            boot_data: fault,
            watch,
            due: Instant(0),
            stores_later: false,
        };
        bench.protocol.show_memory(bench.store.state());
        let monitor = bench.watch.monitor();
        if !monitor.has_sheet(0) {
            monitor.set_sheet(0, sheet(setup.personality), false);
        }
        bench.watch.incident(Instant(0), 0, Incident::PowerOn);
        bench.restart();
        bench.take();
        bench
    }

    /// Switches the power off and on.
    #[must_use]
    pub fn power_cycled(self) -> Bench {
        let retained = self.measurement.retained();
        let power_on = PowerOn { retained, ..intact() };
        Bench::start(self.store.into_flash().0, &self.setup, power_on, self.watch)
    }

    /// Switches the power off and on, with one bit of the last stored record changed.
    ///
    /// # Panics
    /// When nothing is stored.
    #[must_use]
    pub fn power_cycled_with_damage(self) -> Bench {
        let mut flash = self.store.into_flash().0;
        let (first_page, _) = flash.split_at(flash.len() / 2);
        let last = first_page.iter().rposition(|&byte| byte != 0xFF).expect("something is stored");
        // After the last record, which ends with its checksum, come the commit word and the closing mark, four bytes
        // each.
        flash[last - 8] ^= 1;
        let mut watch = self.watch;
        watch.incident(self.now, 0, Incident::Injected);
        Bench::start(flash, &self.setup, intact(), watch)
    }

    /// Boots, or boots again after a reset.
    pub fn restart(&mut self) {
        self.watch.incident(self.now, 0, Incident::Restart);
        if let Some(fault) = self.boot_data {
            let _ = self.protocol.set_fault(fault, true, self.now);
        }
        let next = self.protocol.start(self.now, &mut self.out);
        self.keep(next);
        self.observe();
    }

    /// The next action that the node requests from the firmware. Store jobs are already done.
    pub fn take_action(&mut self) -> Option<Action> {
        self.poll();
        self.actions.pop_front()
    }

    /// Keeps the requests that a call has returned, and carries out store jobs.
    fn keep(&mut self, next: Next) {
        self.has_parameters |= next.parameters;
        match next.action {
            Some(Action::Store(_)) if !self.stores_later => {
                if let Some(job) = self.begin_store() {
                    self.end_store(job);
                }
            }
            Some(Action::Store(_)) => (),
            other => self.actions.extend(other),
        }
    }

    /// Hands over the store job that waits, if any: its values are those of now.
    pub fn begin_store(&mut self) -> Option<StoreJob> {
        take_job(&mut self.protocol, self.now, &mut self.out)
    }

    /// Carries out a store job.
    pub fn end_store(&mut self, mut job: StoreJob) {
        let result = self.store.run(&mut job);
        keep_room(&mut self.protocol, &mut self.store, self.now);
        let next = self.protocol.finish(&job, result, self.now, &mut self.out);
        self.keep(next);
        self.observe();
    }

    /// Shows the monitor the frames that the node has sent.
    fn observe(&mut self) {
        if self.now > self.due {
            // The test has let time pass without the node.
            self.watch.monitor().resume(self.now);
            self.due = Instant::NEVER;
        }
        for frame in std::mem::take(&mut self.out.1) {
            self.watch.frame(self.now, &frame, Sender::Node(0));
        }
        self.probe(None);
    }

    /// Lets the monitor read values beside the bus, before a request or after an answer.
    fn probe(&mut self, request: Option<&Frame>) {
        let Bench { watch, protocol, actions, has_parameters, now, .. } = self;
        let ask = |request: &Frame, answers: &mut Answers| {
            let next = protocol.on_service_frame(request, *now, answers);
            *has_parameters |= next.parameters;
            actions.extend(next.action);
        };
        match request {
            Some(request) => watch.probe_before(*now, 0, request, ask),
            None => watch.probe(*now, 0, ask),
        }
    }

    /// An event on the bus.
    pub fn bus_event(&mut self, event: BusEvent) {
        let _ = self.protocol.bus_event(event, self.now);
        self.poll();
    }

    /// Reports a fault that the firmware has found, or its end.
    pub fn set_fault(&mut self, fault: Fault, active: bool) {
        let _ = self.protocol.set_fault(&fault, active, self.now);
        self.poll();
    }

    /// All frames sent since the last call, as identifier and data.
    pub fn take(&mut self) -> Vec<(u16, Vec<u8>)> {
        self.out.0.drain(..).map(|frame| (frame.id(), frame.data().to_vec())).collect()
    }

    /// Passes a frame to the node, as the acceptance filters do.
    pub fn receive(&mut self, frame: &Frame) {
        self.observe();
        self.probe(Some(frame));
        self.watch.frame(self.now, frame, Sender::Other);
        let is_process = self.protocol.process_ids().any(|id| id == frame.id());
        let is_service = self.protocol.service_ids().any(|id| id == frame.id());
        if is_process {
            let _ = self.protocol.on_process_frame(frame, self.now, &mut self.out);
        }
        if is_service {
            let next = self.protocol.on_service_frame(frame, self.now, &mut self.out);
            self.keep(next);
        }
        self.poll();
    }

    /// Shows the monitor a frame that the test passes to the node itself.
    pub fn overhear(&mut self, frame: &Frame) {
        self.watch.frame(self.now, frame, Sender::Other);
    }

    /// Lets the monitor forget what is saved: the test changes the parameter store itself.
    pub fn forget_saved(&mut self) {
        self.watch.incident(self.now, 0, Incident::Injected);
    }

    /// An NMT command for this node.
    pub fn nmt(&mut self, command: u8) {
        let [node_id, _] = self.id().to_le_bytes();
        self.receive(&Frame::new(0, &[command, node_id]).expect("a frame"));
    }

    /// Does all work that is due and returns the next deadline.
    pub fn poll(&mut self) -> Instant {
        loop {
            let process = self.protocol.poll_process(self.now, &mut self.out).process;
            let next = self.protocol.poll_services(self.now, &mut self.out);
            self.keep(next);
            if next.action.is_none() {
                let due = process.min(next.services);
                self.observe();
                self.watch.feed(|monitor| monitor.deadline(self.now, 0, due));
                self.due = due;
                return due;
            }
        }
    }

    /// Lets a millisecond pass with these readings.
    pub fn sample(&mut self, raw: &RawSample) {
        self.now = self.now + Duration::from_millis(1);
        if std::mem::take(&mut self.has_parameters) {
            self.measurement.apply(&self.protocol.parameters());
        }
        let inputs = Inputs { analogue: *raw, position: self.encoder, digital: self.buttons };
        self.measurement.update(&inputs, self.protocol.snapshot_mut());
        let _ = self.protocol.publish(self.now, &mut self.out);
        self.poll();
    }

    /// Reads a value.
    ///
    /// # Errors
    /// The abort code.
    ///
    /// # Panics
    /// Without a valid response.
    pub fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        Client::new(self).read(Multiplexer { index, sub }).map_err(abort_code)
    }

    /// Writes a value.
    ///
    /// # Errors
    /// The abort code.
    ///
    /// # Panics
    /// Without a valid response.
    pub fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        Client::new(self).write(Multiplexer { index, sub }, bytes).map_err(abort_code)
    }

    /// Makes a TPDO invalid and its mapping empty, steps 1 and 2 of the mapping procedure.
    ///
    /// # Panics
    /// When the node refuses.
    pub fn disable_tpdo(&mut self, number: u16) {
        self.switch_tpdo_off(number);
        self.write(0x1A00 + number, 0, &[0]).expect("step 2");
    }

    /// Makes a TPDO invalid.
    ///
    /// # Panics
    /// When the node refuses.
    pub fn switch_tpdo_off(&mut self, number: u16) {
        let cob_id = self.read(0x1800 + number, 1).expect("a COB-ID");
        let [a, b, c, d] = cob_id.try_into().expect("four bytes");
        self.write(0x1800 + number, 1, &[a, b, c, d | 0x80]).expect("step 1");
    }
}

/// The SDO channel; the node answers at once or not at all.
impl Channel for Bench {
    fn send(&mut self, request: [u8; 8]) {
        self.receive(&Frame::new(0x600 + self.id(), &request).expect("a frame"));
    }

    fn received(&mut self) -> Option<[u8; 8]> {
        let response = 0x580 + self.id();
        let place = self.out.0.iter().position(|frame| frame.id() == response)?;
        self.out.0.remove(place).data().try_into().ok()
    }

    fn wait(&mut self) -> Option<[u8; 8]> {
        self.received()
    }
}

fn abort_code(failure: Failure) -> u32 {
    match failure {
        Failure::Refused(code) => code,
        other => panic!("{other:?}"),
    }
}
