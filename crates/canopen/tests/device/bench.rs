//! A device with a small dictionary, a queue that records, and a client that talks to it.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Entry, Group, Mapping, Object, Type};
use canopen::nmt::State;
use canopen::sdo::{Abort, Bytes, Initiate, Multiplexer, Request, Response, Segment};
use canopen::{
    Action, Application, BusEvent, Condition, Device, Duration, ErrorClass, Fault, Frame, Instant, Next,
    NodeId, Part, QueueFull, Soundness, Stored, Transmit,
};
use proptest::prelude::ProptestConfig;
use proptest::test_runner::RngSeed;
use std::collections::VecDeque;

const fn parameter(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite).stored(Group::Communication)
}

const fn value(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn command(index: u16, sub: u8) -> Object {
    Object::new(index, sub, "", Type::Unsigned32, Access::ReadWrite).value(1)
}

const ROWS: &[Object] = &[
    Object::new(0x1000, 0, "", Type::Unsigned32, Access::ReadOnly).value(0x0002_0194),
    Object::new(0x1001, 0, "", Type::Unsigned8, Access::ReadOnly),
    Object::new(0x1003, 0, "", Type::Unsigned8, Access::ReadWrite),
    Object::new(0x1003, 1, "", Type::Unsigned32, Access::ReadOnly),
    Object::new(0x1003, 2, "", Type::Unsigned32, Access::ReadOnly),
    parameter(0x1005, 0, Type::Unsigned32).value(0x80),
    parameter(0x1006, 0, Type::Unsigned32),
    parameter(0x1007, 0, Type::Unsigned32),
    Object::new(0x1008, 0, "", Type::VisibleString(32), Access::Const)
        .default(DefaultValue::Text("a name of twenty-six chars")),
    Object::highest(0x1010, 3, ""),
    command(0x1010, 1),
    command(0x1010, 2),
    command(0x1010, 3),
    Object::highest(0x1011, 3, ""),
    command(0x1011, 1),
    command(0x1011, 2),
    command(0x1011, 3),
    parameter(0x1014, 0, Type::Unsigned32).default(DefaultValue::NodeId(0x80)),
    parameter(0x1015, 0, Type::Unsigned16),
    Object::highest(0x1016, 4, ""),
    parameter(0x1016, 1, Type::Unsigned32),
    parameter(0x1016, 2, Type::Unsigned32),
    parameter(0x1016, 3, Type::Unsigned32),
    parameter(0x1016, 4, Type::Unsigned32),
    parameter(0x1017, 0, Type::Unsigned16).value(1000),
    Object::highest(0x1018, 4, ""),
    Object::new(0x1018, 1, "", Type::Unsigned32, Access::ReadOnly).value(0x1A),
    Object::new(0x1018, 2, "", Type::Unsigned32, Access::ReadOnly).value(0x2B),
    Object::new(0x1018, 3, "", Type::Unsigned32, Access::ReadOnly).value(0x0001_0002),
    Object::new(0x1018, 4, "", Type::Unsigned32, Access::ReadOnly).value(0x8000_0005),
    parameter(0x1019, 0, Type::Unsigned8).limits(0, 240),
    Object::highest(0x1029, 2, ""),
    parameter(0x1029, 1, Type::Unsigned8).limits(0, 254),
    parameter(0x1029, 2, Type::Unsigned8).limits(0, 2),
    Object::highest(0x1400, 5, ""),
    parameter(0x1400, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x8000_0200)),
    parameter(0x1400, 2, Type::Unsigned8).value(255),
    parameter(0x1400, 5, Type::Unsigned16),
    Object::highest(0x1401, 5, ""),
    parameter(0x1401, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x8000_0300)),
    parameter(0x1401, 2, Type::Unsigned8).value(1),
    parameter(0x1401, 5, Type::Unsigned16),
    parameter(0x1600, 0, Type::Unsigned8),
    parameter(0x1600, 1, Type::Unsigned32),
    parameter(0x1600, 2, Type::Unsigned32),
    parameter(0x1601, 0, Type::Unsigned8).limits(0, 2).value(1),
    parameter(0x1601, 1, Type::Unsigned32).value(0x6200_0010),
    parameter(0x1601, 2, Type::Unsigned32),
    Object::highest(0x1800, 6, ""),
    parameter(0x1800, 1, Type::Unsigned32).default(DefaultValue::NodeId(0x180)),
    parameter(0x1800, 2, Type::Unsigned8).value(255),
    parameter(0x1800, 3, Type::Unsigned16),
    parameter(0x1800, 5, Type::Unsigned16).value(100),
    parameter(0x1800, 6, Type::Unsigned8).limits(0, 240),
    parameter(0x1A00, 0, Type::Unsigned8).value(1),
    parameter(0x1A00, 1, Type::Unsigned32).value(0x6000_0120),
    parameter(0x1A00, 2, Type::Unsigned32),
    parameter(0x1A00, 3, Type::Unsigned32),
    parameter(0x1A00, 4, Type::Unsigned32),
    parameter(0x1F80, 0, Type::Unsigned32),
    parameter(0x1FA0, 0, Type::Unsigned8).limits(0, 2),
    parameter(0x1FA0, 1, Type::Unsigned32),
    parameter(0x1FA0, 2, Type::Unsigned32),
    parameter(0x1FD0, 0, Type::Unsigned8).limits(0, 2),
    parameter(0x1FD0, 1, Type::Unsigned64),
    parameter(0x1FD0, 2, Type::Unsigned64),
    Object::new(0x5F00, 0, "", Type::Unsigned8, Access::ReadWrite).limits(0, 2).setting(),
    Object::highest(0x6000, 3, ""),
    value(0x6000, 1, Type::Integer32),
    value(0x6000, 2, Type::Integer16),
    value(0x6000, 3, Type::Integer32),
    Object::new(0x6100, 0, "", Type::Integer16, Access::ReadWrite).limits(-5, 5).stored(Group::Application),
    Object::new(0x6101, 0, "", Type::Real32, Access::ReadWrite).stored(Group::Application),
    Object::new(0x6102, 0, "", Type::Unsigned32, Access::WriteOnly).handled(),
    Object::new(0x6103, 0, "", Type::VisibleString(20), Access::ReadWrite).stored(Group::Application),
    Object::new(0x6104, 0, "", Type::Domain, Access::ReadWrite).handled(),
    Object::new(0x6105, 0, "", Type::Unsigned16, Access::ReadWrite).event_timer_of(0),
    Object::new(0x6106, 0, "", Type::Real32, Access::ReadWrite).stored(Group::Calibration),
    Object::new(0x6107, 0, "", Type::Unsigned32, Access::ReadWrite).value(1).stores_calibration(),
    Object::new(0x6200, 0, "", Type::Unsigned16, Access::ReadWrite).mappable(Mapping::Rpdo),
    Object::new(0x6201, 0, "", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo).handled(),
    Object::new(0x6202, 0, "", Type::Boolean, Access::ReadWrite).mappable(Mapping::Rpdo),
    Object::new(0x6203, 0, "", Type::Integer16, Access::ReadWrite).limits(-5, 5).mappable(Mapping::Rpdo),
    Object::new(0x6204, 0, "", Type::Unsigned64, Access::ReadWrite).mappable(Mapping::Both),
];

const SIZE: usize = dictionary::image_size(ROWS);

pub(crate) const DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The rows and their entries, for what compares them.
pub(crate) fn rows() -> impl Iterator<Item = (&'static Object, Entry)> {
    ROWS.iter().zip(DICTIONARY.entries())
}

/// The conditions of the application.
pub(crate) const SENSOR_BREAK: u8 = 0;
pub(crate) const PRESSURE_RAIL: u8 = 1;
pub(crate) const TEMPERATURE_RAIL: u8 = 2;
pub(crate) const UNEXPECTED_RESET: u8 = 3;

/// What the device told its application.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Told {
    Written(u16, u8),
    Received(u16),
    Sync(Option<u8>),
    State(State),
    Fault(Fault, bool),
    Error(ErrorClass),
}

/// Takes 4711 and nothing else at 6102h, and keeps a domain of up to 5000 bytes.
#[derive(Default)]
pub(crate) struct Numbers {
    /// 1F80h, as if it came from a store.
    pub(crate) start_up: u8,
    pub(crate) domain: Vec<u8>,
    pub(crate) downloads: usize,
    /// What is stored: communication, application, calibration.
    pub(crate) stored: [Vec<u8>; 3],
    pub(crate) is_damaged: bool,
    /// What the device said of the groups that it loaded.
    pub(crate) loaded: Vec<(Group, bool)>,
    pub(crate) told: Vec<Told>,
    /// The TPDO whose frames are events; 0 for none.
    pub(crate) event_tpdo: u16,
    /// The value of the event that was told last: each change of 6000h:1 is one.
    pub(crate) last_event: Option<[u8; 4]>,
    /// Events that wait, instead: the values of 6000h:1 to tell.
    pub(crate) events: VecDeque<[u8; 4]>,
    /// An object that no multiplexed TPDO tells to all nodes.
    pub(crate) not_told: Option<Multiplexer>,
}

impl Application for Numbers {
    const CONDITIONS: &'static [Condition] =
        &[Condition::new(0x5006), Condition::new(0x8002), Condition::new(0x8001), Condition::new(0x6101)];

    fn initialise(&mut self, image: &mut [u8]) {
        DICTIONARY.field(0x1F80, 0).set(image, &[self.start_up]);
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if entry.index() == 0x6201 {
            // Switches TPDO 1 and RPDO 1 off and on.
            if let [14 | 15] = bytes {
                let valid = if bytes == [14] { 0x80 } else { 0 };
                DICTIONARY.field(0x1800, 1).store(image, [0x85, 0x01, 0, valid]);
                DICTIONARY.field(0x1400, 1).store(image, [0x05, 0x02, 0, valid]);
            }
            return if bytes == [13] { Err(Abort::InvalidValue) } else { Ok(()) };
        }
        assert_eq!((entry.index(), entry.sub()), (0x6102, 0));
        if bytes == 4711_u32.to_le_bytes() { Ok(()) } else { Err(Abort::NotStored) }
    }

    fn sends_events(&self, tpdo: u16) -> bool {
        tpdo == self.event_tpdo
    }

    fn begin_events(&mut self, tpdo: u16, _: &mut [u8]) {
        assert_eq!(tpdo, self.event_tpdo);
        self.last_event = None;
    }

    fn next_event(&mut self, tpdo: u16, image: &mut [u8]) -> bool {
        assert_eq!(tpdo, self.event_tpdo);
        let field = DICTIONARY.field(0x6000, 1);
        if let Some(event) = self.events.pop_front() {
            field.set(image, &event);
            self.last_event = Some(event);
            return true;
        }
        let now = field.load(image);
        self.last_event.replace(now) != Some(now)
    }

    fn broadcasts(&self, at: Multiplexer, _: &[u8]) -> bool {
        self.not_told != Some(at)
    }

    fn stored(&self, group: Group) -> Stored<'_> {
        let [communication, application, calibration] = &self.stored;
        let packed: &[u8] = match group {
            Group::Communication => communication,
            Group::Application => application,
            Group::Calibration => calibration,
        };
        let soundness = if self.is_damaged { Soundness::Older } else { Soundness::Whole };
        Stored { packed, soundness }
    }

    fn loaded(&mut self, group: Group, good: bool) {
        self.loaded.push((group, good));
    }

    fn written(&mut self, entry: &Entry, _: &mut [u8]) {
        self.told.push(Told::Written(entry.index(), entry.sub()));
    }

    fn received(&mut self, rpdo: u16, _: &mut [u8]) {
        self.told.push(Told::Received(rpdo));
    }

    fn synchronised(&mut self, counter: Option<u8>, _: &mut [u8]) {
        self.told.push(Told::Sync(counter));
    }

    fn state(&mut self, state: State, _: &mut [u8]) {
        self.told.push(Told::State(state));
    }

    fn fault(&mut self, fault: Fault, active: bool, _: &mut [u8]) {
        self.told.push(Told::Fault(fault, active));
    }

    fn error(&mut self, class: ErrorClass, _: &mut [u8]) {
        self.told.push(Told::Error(class));
    }

    fn read_domain(&self, at: Multiplexer) -> Result<&[u8], Abort> {
        assert_eq!(at, DOMAIN);
        Ok(&self.domain)
    }

    fn write_domain(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        assert_eq!(at, DOMAIN);
        match part {
            Part::Begin(_) => self.domain.clear(),
            Part::Data(offset, bytes) => {
                assert_eq!(offset, self.domain.len());
                self.domain.extend_from_slice(bytes);
            }
            Part::End(len) => {
                assert_eq!(len, self.domain.len());
                self.downloads += 1;
            }
        }
        if self.domain.len() > 5000 { Err(Abort::NotStored) } else { Ok(()) }
    }
}

/// A transmit queue that keeps all it gets, as long as it has room.
pub(crate) struct Queue {
    pub(crate) frames: Vec<Frame>,
    /// Identifiers of those that came as states.
    pub(crate) states: Vec<u16>,
    pub(crate) room: usize,
}

impl Transmit for Queue {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.room = self.room.checked_sub(1).ok_or(QueueFull)?;
        self.frames.push(frame);
        Ok(())
    }

    fn send_state(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.send(frame)?;
        self.states.push(frame.id());
        Ok(())
    }

    fn room(&self) -> usize {
        self.room
    }
}

const DOMAIN: Multiplexer = Multiplexer { index: 0x6104, sub: 0 };

/// Node-ID of the device under test.
pub(crate) const ID: u8 = 5;

/// A device, its queue and the time.
pub(crate) struct Bench {
    pub(crate) device: Device<Numbers, SIZE>,
    pub(crate) out: Queue,
    pub(crate) now: Instant,
    /// What the device left to its caller.
    actions: VecDeque<Action>,
    parameters: bool,
}

impl Bench {
    /// A device that has booted and whose boot-up message is out of the way.
    pub(crate) fn booted() -> Bench {
        let mut bench = Bench::unstarted();
        bench.start();
        bench.take();
        bench
    }

    pub(crate) fn operational() -> Bench {
        let mut bench = Bench::booted();
        bench.nmt(1);
        bench.take();
        bench
    }

    pub(crate) fn unstarted() -> Bench {
        Bench::with_node_id(NodeId::new(ID))
    }

    /// A device that has started without a node-ID.
    pub(crate) fn unconfigured() -> Bench {
        let mut bench = Bench::with_node_id(None);
        bench.start();
        bench
    }

    fn with_node_id(node_id: Option<NodeId>) -> Bench {
        let device = Device::new(&DICTIONARY, node_id, Numbers::default());
        Bench {
            device,
            out: Queue { frames: vec![], states: vec![], room: usize::MAX },
            now: Instant(1_000_000),
            actions: VecDeque::new(),
            parameters: false,
        }
    }

    pub(crate) fn start(&mut self) {
        let next = self.device.start(self.now, &mut self.out);
        self.follow(next);
    }

    /// Keeps what follows from a call. What waits is handed over by the next one.
    fn follow(&mut self, next: Next) -> Instant {
        self.parameters |= next.parameters;
        match next.action {
            Some(action) => {
                self.actions.push_back(action);
                self.poll()
            }
            None => next.due(),
        }
    }

    /// The next thing that was left to the caller.
    pub(crate) fn take_action(&mut self) -> Option<Action> {
        self.poll();
        self.actions.pop_front()
    }

    pub(crate) fn take_parameters(&mut self) -> bool {
        self.poll();
        std::mem::take(&mut self.parameters)
    }

    pub(crate) fn raise(&mut self, condition: u8) {
        let _ = self.device.set_condition(condition, true, self.now);
    }

    pub(crate) fn clear(&mut self, condition: u8) {
        let _ = self.device.set_condition(condition, false, self.now);
    }

    pub(crate) fn bus(&mut self, event: BusEvent) {
        let next = self.device.on_bus(event, self.now);
        self.follow(next);
        self.poll();
    }

    pub(crate) fn error(&mut self, class: ErrorClass) {
        let next = self.device.error(class);
        self.follow(next);
    }

    pub(crate) fn finish(&mut self, result: Result<(), Abort>) {
        let next = self.device.finish(result, self.now, &mut self.out);
        self.follow(next);
    }

    /// What the application was told since the last call.
    pub(crate) fn told(&mut self) -> Vec<Told> {
        std::mem::take(&mut self.device.application_mut().told)
    }

    /// All frames sent since the last call.
    pub(crate) fn take(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.out.frames)
    }

    /// Frames sent since the last call, as identifier and data.
    pub(crate) fn sent(&mut self) -> Vec<(u16, Vec<u8>)> {
        self.take().iter().map(|frame| (frame.id(), frame.data().to_vec())).collect()
    }

    /// Hands a frame to both halves, as filters would not.
    pub(crate) fn receive(&mut self, frame: Frame) {
        let next = self.device.on_frame(&frame, self.now, &mut self.out);
        self.follow(next);
        self.poll();
    }

    pub(crate) fn poll(&mut self) -> Instant {
        let next = self.device.poll(self.now, &mut self.out);
        self.follow(next)
    }

    pub(crate) fn nmt(&mut self, command: u8) {
        self.receive(Frame::new(0, &[command, ID]).unwrap());
    }

    pub(crate) fn sync(&mut self) {
        self.receive(Frame::new(0x80, &[]).unwrap());
    }

    /// Lets time pass, from deadline to deadline as the firmware does.
    pub(crate) fn run(&mut self, span: Duration) {
        let end = self.now + span;
        loop {
            let due = self.poll().max(Instant(self.now.0 + 1));
            if due > end {
                self.now = end;
                return;
            }
            self.now = due;
        }
    }

    /// Runs and gives the instants at which frames with this identifier were sent, from now on.
    pub(crate) fn times_of(&mut self, id: u16, span: Duration) -> Vec<u64> {
        let (start, end) = (self.now, self.now + span);
        let mut times = vec![];
        loop {
            let due = self.poll().max(Instant(self.now.0 + 1));
            let sent = self.take().iter().filter(|frame| frame.id() == id).count();
            times.extend(std::iter::repeat_n(self.now.0 - start.0, sent));
            if due > end {
                self.now = end;
                return times;
            }
            self.now = due;
        }
    }

    pub(crate) fn set_value(&mut self, sub: u8, bytes: &[u8]) {
        let field = DICTIONARY.field(0x6000, sub);
        let next = self.device.publish(self.now, &mut self.out, |_, image| field.set(image, bytes));
        self.follow(next);
    }

    /// One SDO exchange.
    pub(crate) fn ask(&mut self, request: Request) -> Option<Response> {
        self.ask_raw(request.encode())
    }

    pub(crate) fn ask_raw(&mut self, request: [u8; 8]) -> Option<Response> {
        let before = self.take();
        self.receive(Frame::new(0x600 + u16::from(ID), &request).unwrap());
        let id = 0x580 + u16::from(ID);
        let (responses, others): (Vec<_>, Vec<_>) = self.take().into_iter().partition(|f| f.id() == id);
        self.out.frames = before.into_iter().chain(others).collect();
        assert!(responses.len() <= 1, "more than one response");
        let data = responses.first()?.data().try_into().unwrap();
        Some(Response::parse(data).expect("no valid response"))
    }

    /// Reads a value by whatever transfer the server chooses.
    pub(crate) fn read(&mut self, index: u16, sub: u8) -> Result<Vec<u8>, u32> {
        let at = Multiplexer { index, sub };
        match self.ask(Request::Upload(at)).unwrap() {
            Response::Uploaded(of, bytes) if of == at => Ok(bytes.as_slice().to_vec()),
            Response::UploadSegmented(of, Some(size)) if of == at => Ok(self.read_segments(size)),
            Response::Abort(of, code) if of == at => Err(code),
            other => panic!("{other:?}"),
        }
    }

    fn read_segments(&mut self, size: u32) -> Vec<u8> {
        let mut value = vec![];
        for toggle in [false, true].into_iter().cycle() {
            let Some(Response::UploadedSegment(Segment { toggle: t, last, data })) =
                self.ask(Request::UploadSegment { toggle })
            else {
                panic!()
            };
            assert_eq!(t, toggle);
            value.extend_from_slice(data.as_slice());
            if last {
                break;
            }
        }
        assert_eq!(value.len(), size as usize);
        value
    }

    /// Writes up to four bytes, expedited.
    pub(crate) fn write(&mut self, index: u16, sub: u8, bytes: &[u8]) -> Result<(), u32> {
        let at = Multiplexer { index, sub };
        let payload = Initiate::Expedited(Bytes::from_slice(bytes));
        match self.ask(Request::Download(at, payload)).unwrap() {
            Response::Downloaded(of) if of == at => Ok(()),
            Response::Abort(of, code) if of == at => Err(code),
            other => panic!("{other:?}"),
        }
    }

    pub(crate) fn write32(&mut self, index: u16, sub: u8, value: u32) -> Result<(), u32> {
        self.write(index, sub, &value.to_le_bytes())
    }
}

/// Property tests that take the same course each time.
pub(crate) fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}
