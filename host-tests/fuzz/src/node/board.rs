//! The node on a board: does the work of the firmware's tasks around the node.

use std::collections::VecDeque;

use canopen::dictionary::Object;
use canopen::{Action, Duration, Frame, Instant, Next, NodeId, QueueFull, Transmit};
use node::{
    BitRate, EraseBudget, Measurement, ParameterMemory, Personality, Protocol, Setup, State, StoreJob,
};
use profiles::board::{ChipThermometer, Inputs, PowerOn, RawEncoder, RawSample, Retained};
use storage::{DeviceRecord, Pages, View};

use super::flash::{Flash, PAGE};
use super::step::{LONGEST_QUEUE, Step, raw};
use super::watch::Watch;

const PAGES: Pages = Pages::new(0, PAGE);
/// A chip whose temperature sensor is calibrated.
const CHIP: ChipThermometer = ChipThermometer { offset: 24.6, slope: 444.0 };
/// The longest erase of a page.
const ERASE: Duration = Duration::from_millis(500);
/// Limit of the requests that a call can leave.
const REQUESTS: usize = 16;

/// A transmit queue with limited space.
#[derive(Debug)]
pub(super) struct Queue {
    waiting: Vec<Frame>,
    is_congested: bool,
    length: usize,
}

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if self.room() == 0 {
            return Err(QueueFull);
        }
        self.waiting.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        self.length - self.waiting.len()
    }
}

/// A board.
#[derive(Debug)]
pub(super) struct Board {
    unless_stored: Setup,
    pub(super) personality: Personality,
    pub(super) protocol: Protocol,
    measurement: Measurement,
    flash: Flash,
    memory: Option<ParameterMemory<Flash>>,
    pub(super) out: Queue,
    pub(super) now: Instant,
    pub(super) due: Instant,
    filters: [Vec<u16>; 2],
    actions: VecDeque<Action>,
    has_parameters: bool,
    /// Whether the node has started since the last step.
    pub(super) has_started: bool,
    watch: Watch,
}

impl Board {
    pub(super) fn new(personality: Personality) -> Board {
        let unless_stored = Setup {
            personality,
            node_id: NodeId::new(0x21),
            bit_rate: BitRate::FASTEST,
            program_id: 0x0BAD_CAFE,
            serial_number: 0x1234_5678,
            hardware_version: "fuzz",
            software_version: "0",
        };
        let mut board = Board {
            unless_stored,
            personality,
            protocol: Protocol::new(&unless_stored),
            measurement: Measurement::new(personality, &PowerOn::default()),
            flash: Flash::erased(),
            memory: None,
            out: Queue { waiting: vec![], is_congested: false, length: LONGEST_QUEUE },
            now: Instant(0),
            due: Instant(0),
            filters: [vec![], vec![]],
            actions: VecDeque::new(),
            has_parameters: false,
            has_started: false,
            watch: Watch::new(personality, None),
        };
        board.power_on(Retained::Nothing);
        board.settle();
        board.sent();
        board
    }

    /// Powers on like the firmware. After a power cut during the start, the start begins again.
    fn power_on(&mut self, retained: Retained) {
        self.out.waiting.clear();
        self.actions.clear();
        self.memory = None;
        let mut parameters = self.protocol.parameters();
        while self.memory.is_none() {
            self.flash.power_up();
            let mut view = View::open(self.flash.clone(), PAGES).expect("there is power");
            let record = view.device().expect("there is power");
            let setup = record.map_or(self.unless_stored, |record| stored(record, &self.unless_stored));
            self.personality = setup.personality;
            self.protocol = Protocol::new(&setup);
            parameters = self.protocol.load(&mut view);
            self.memory = ParameterMemory::prepare(view, EraseBudget::new(None)).ok();
        }
        self.show_memory();
        self.measurement = Measurement::new(
            self.personality,
            &PowerOn { thermometer: CHIP, retained, ..PowerOn::default() },
        );
        self.measurement.apply(&parameters);
        self.watch = Watch::new(self.personality, None);
        self.watch.starts(self.now);
        self.start();
    }

    /// Keeps the requests that a call of the services half has returned.
    fn keep(&mut self, next: Next) {
        self.actions.extend(next.action);
        self.has_parameters |= next.parameters;
    }

    fn retained(&self) -> Retained {
        self.measurement.retained()
    }

    fn start(&mut self) {
        self.out.waiting.clear();
        self.watch.restarts(self.now);
        let next = self.protocol.start(self.now, &mut self.out);
        self.keep(next);
        self.has_started = true;
    }

    /// The rows of the dictionary of the current personality.
    pub(super) fn rows(&self) -> &'static [Object] {
        self.personality.rows()
    }

    pub(super) fn row(&self, place: u16) -> &'static Object {
        let rows = self.rows();
        &rows[usize::from(place) % rows.len()]
    }

    /// The node-ID, derived from the identifier of the SDO server.
    pub(super) fn node_id(&self) -> Option<u16> {
        self.protocol.service_ids().find(|id| (0x601..=0x67F).contains(id)).map(|id| id - 0x600)
    }

    pub(super) fn state(&self) -> State {
        self.protocol.state()
    }

    /// The frames that were sent.
    pub(super) fn sent(&mut self) -> Vec<Frame> {
        if self.out.is_congested {
            return vec![];
        }
        let frames = std::mem::take(&mut self.out.waiting);
        frames.iter().for_each(|frame| self.watch.sent(self.now, frame));
        frames
    }

    /// Starts with a new monitor: frames were lost, or the bus has stopped the node.
    fn watch_again(&mut self) {
        self.watch = Watch::new(self.personality, self.node_id());
    }

    /// Carries out one step and all its consequences at this instant.
    pub(super) fn take(&mut self, step: &Step) {
        self.has_started = false;
        match *step {
            Step::Sdo(data) => self.sdo(data),
            Step::Read { row } => self.sdo(upload(self.row(row))),
            Step::Write { row, value } => self.sdo(download(self.row(row), Step::download(row, value))),
            Step::Nmt { command, to_all } => self.nmt(command, to_all),
            Step::Process { place, len, remote, data } => {
                self.receive(pick(&self.filters[0], place), len, remote, data);
            }
            Step::Service { place, data } => self.receive(pick(&self.filters[1], place), 8, false, data),
            Step::Frame { id, len, remote, data } => self.receive(id, len, remote, data),
            Step::Lss(data) => self.receive(0x7E5, 8, false, data),
            Step::Sample { pressure, supply, temperature, reference, encoder, buttons } => {
                self.sample(&raw(pressure, supply, temperature, reference), encoder, buttons);
            }
            Step::Bus(report) => {
                let _ = self.protocol.bus_event(report.into(), self.now);
                self.watch_again();
            }
            Step::Deadline => self.now = self.now.max(self.due.min(Instant(self.now.0 + 1_000_000))),
            Step::Wait(time) => self.now = self.now + Duration(time.into()),
            Step::Congest(congestion) => {
                let (is_congested, length) = Step::queue(congestion);
                self.out = Queue { waiting: vec![], is_congested, length };
                self.watch_again();
            }
            Step::PowerCycle => self.power_on(self.retained()),
            Step::PowerCut { after } => self.flash.cut_after(after),
        }
        self.settle();
    }

    fn nmt(&mut self, command: u8, to_all: bool) {
        let commands = [0x01, 0x02, 0x80, 0x81, 0x82];
        let node = if to_all { 0 } else { self.node_id().unwrap_or(0) };
        let data = [commands[usize::from(command) % commands.len()], node.to_le_bytes()[0], 0, 0, 0, 0, 0, 0];
        self.receive(0, 2, false, data);
    }

    pub(super) fn sdo(&mut self, data: [u8; 8]) {
        if let Some(node_id) = self.node_id() {
            self.receive(0x600 + node_id, 8, false, data);
        }
    }

    fn receive(&mut self, id: u16, len: u8, remote: bool, data: [u8; 8]) {
        let len = len % 9;
        let id = id & 0x7FF;
        let frame = if remote { Frame::remote(id, len) } else { Frame::new(id, &data[..usize::from(len)]) };
        let frame = frame.expect("an identifier of 11 bits and at most eight bytes");
        if self.filters.iter().flatten().any(|passed| *passed == id) {
            self.watch.received(self.now, &frame);
        }
        if self.filters[0].contains(&id) {
            let _ = self.protocol.on_process_frame(&frame, self.now, &mut self.out);
        }
        if self.filters[1].contains(&id) {
            let next = self.protocol.on_service_frame(&frame, self.now, &mut self.out);
            self.keep(next);
        }
    }

    fn sample(&mut self, raw: &RawSample, encoder: u16, buttons: [bool; 2]) {
        self.now = self.now + Duration::from_millis(1);
        if std::mem::take(&mut self.has_parameters) {
            self.measurement.apply(&self.protocol.parameters());
        }
        let position = RawEncoder { counter: encoder, ..RawEncoder::default() };
        let inputs = Inputs { analogue: *raw, position, digital: buttons };
        self.measurement.update(&inputs, self.protocol.snapshot_mut());
        let _ = self.protocol.publish(self.now, &mut self.out);
        // A store job may have waited for the values of new parameters.
        self.run_job();
    }

    /// Polls and carries out requests until no more is due now.
    pub(super) fn settle(&mut self) {
        self.fulfil();
        for _ in 0..REQUESTS {
            self.due = self.poll();
            self.fulfil();
            if self.due > self.now {
                return;
            }
        }
        panic!("what is due at {:?} stays due", self.now);
    }

    fn poll(&mut self) -> Instant {
        let process = self.protocol.poll_process(self.now, &mut self.out).process;
        let next = self.protocol.poll_services(self.now, &mut self.out);
        self.keep(next);
        process.min(next.services)
    }

    fn fulfil(&mut self) {
        for _ in 0..REQUESTS {
            let Some(action) = self.actions.pop_front() else { return };
            match action {
                Action::ResetNode | Action::Bootloader => {
                    self.power_on(self.retained());
                }
                Action::ResetCommunication => self.start(),
                Action::Identifiers => {
                    self.filters =
                        [self.protocol.process_ids().collect(), self.protocol.service_ids().collect()];
                }
                Action::BitRate(_) => (),
                Action::Store(_) => self.run_job(),
            }
        }
        panic!("the requests have no end");
    }

    fn run_job(&mut self) {
        let mut job = StoreJob::new(Personality::default());
        let Some(memory) = self.memory.as_mut().filter(|_| self.protocol.take_job(&mut job)) else { return };
        let result = memory.run(&mut job);
        if memory.can_make_room(self.now) && self.protocol.can_pause(ERASE, self.now) {
            let _ = memory.make_room();
        }
        if self.flash.is_down() {
            return self.power_on(Retained::Nothing);
        }
        self.show_memory();
        let _ = self.protocol.finish(&job, result, self.now, &mut self.out);
    }

    fn show_memory(&mut self) {
        if let Some(memory) = &self.memory {
            self.protocol.show_memory(memory.state());
        }
    }
}

/// The setup from the stored device record, as the firmware reads it.
fn stored(record: DeviceRecord, unless_stored: &Setup) -> Setup {
    Setup {
        personality: Personality::numbered(record.personality()).expect("one that was stored"),
        node_id: NodeId::new(record.node_id()),
        bit_rate: BitRate::from_kbit(record.bit_rate_kbit()).expect("one that was stored"),
        ..*unless_stored
    }
}

fn pick(ids: &[u16], place: u8) -> u16 {
    if ids.is_empty() { 0 } else { ids[usize::from(place) % ids.len()] }
}

/// The SDO request for an upload.
pub(super) fn upload(row: &Object) -> [u8; 8] {
    request(0x40, row, [0; 4])
}

/// The SDO request for an expedited download, with the length of the object or four bytes.
pub(super) fn download(row: &Object, value: [u8; 4]) -> [u8; 8] {
    let unused = 4 - row.kind.size().clamp(1, 4);
    request(0x23 | unused << 2, row, value)
}

fn request(command: u8, row: &Object, [a, b, c, d]: [u8; 4]) -> [u8; 8] {
    let [low, high] = row.index.to_le_bytes();
    [command, low, high, row.sub, a, b, c, d]
}
