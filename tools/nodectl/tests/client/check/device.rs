//! A device based on the library's own device, with everything that a check needs. It adds node guarding, a SYNC
//! producer and sub-index FFh, which the library leaves out.

use crate::wire::Answers;
use canopen::dictionary::{
    Access, DefaultValue, Dictionary, Entry, Group, Mapping, Object, Services, Sizes, Type,
};
use canopen::{
    Action, Application, Device, Duration, Frame, Instant, Job, Next, NodeId, Soundness, Stored, objects,
};
use nodectl::check::Profile;

/// The node-ID of the device.
pub(super) const ID: u8 = 5;
/// The identity by which the data sheet is found.
const VENDOR: u32 = 0x1A2;
const PRODUCT: u32 = 0x77;
const REVISION: u32 = 0x0001_0003;

const fn parameter(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "Parameter", kind, Access::ReadWrite).stored(Group::Communication)
}

const fn own(index: u16, kind: Type) -> Object {
    own_at(index, 0, kind)
}

const fn own_at(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "Own parameter", kind, Access::ReadWrite).stored(Group::Application)
}

const fn input(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "Input", kind, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn fixed(index: u16, sub: u8, kind: Type, value: i64) -> Object {
    Object::new(index, sub, "Fixed", kind, Access::ReadOnly).value(value)
}

const OUTPUT: Object =
    Object::new(0x2011, 0, "Output", Type::Unsigned16, Access::ReadWrite).mappable(Mapping::Rpdo);

const SERVERS: [Object; 9] = [
    Object::highest(0x1200, 2, "SDO server parameter"),
    Object::new(0x1200, 1, "COB-ID client to server", Type::Unsigned32, Access::ReadOnly)
        .default(DefaultValue::NodeId(0x600)),
    Object::new(0x1200, 2, "COB-ID server to client", Type::Unsigned32, Access::ReadOnly)
        .default(DefaultValue::NodeId(0x580)),
    Object::highest(0x1201, 2, "SDO server parameter"),
    parameter(0x1201, 1, Type::Unsigned32).value(1 << 31),
    parameter(0x1201, 2, Type::Unsigned32).value(1 << 31),
    Object::highest(0x1280, 2, "SDO client parameter"),
    parameter(0x1280, 1, Type::Unsigned32).value(1 << 31),
    parameter(0x1280, 2, Type::Unsigned32).value(1 << 31),
];

const OTHERS: [Object; 12] = [
    parameter(0x100C, 0, Type::Unsigned16),
    parameter(0x100D, 0, Type::Unsigned8),
    Object::highest(0x1020, 2, "Verify configuration"),
    parameter(0x1020, 1, Type::Unsigned32),
    parameter(0x1020, 2, Type::Unsigned32),
    own(0x2000, Type::Real32),
    own(0x2001, Type::Integer16).limits(-5, 5),
    Object::new(0x2002, 0, "Command", Type::Unsigned32, Access::WriteOnly).handled(),
    own(0x2003, Type::Unsigned32),
    Object::highest(0x2010, 2, "Inputs"),
    input(0x2010, 1, Type::Unsigned16).value(0x1234),
    input(0x2010, 2, Type::Integer32).value(0x0765_4321),
];

/// The rows of every device and the rows of a profile.
macro_rules! device {
    ($type:expr, $rows:expr) => {{
        const ROWS: &[Object] = canopen::rows!(
            [objects::device_type($type), objects::error_register()],
            objects::error_field::<5>(),
            objects::sync_consumer(),
            [
                objects::device_name("a device with thirty letters.."),
                objects::hardware_version("1"),
                objects::software_version("1.0.3"),
            ],
            objects::store_parameters(),
            objects::restore_parameters(),
            objects::emergency(),
            objects::heartbeat_consumer::<5>(),
            [objects::heartbeat_producer(1000)],
            objects::identity(VENDOR, PRODUCT, REVISION),
            objects::error_behaviour(0),
            SERVERS,
            OTHERS,
            [OUTPUT],
            objects::rpdo(1, &[OUTPUT]),
            objects::tpdo(1, &[input(0x2010, 1, Type::Unsigned16)]),
            $rows,
        );
        static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
        (ROWS, &DICTIONARY)
    }};
}

type Table = (&'static [Object], &'static Dictionary);

const NOTHING: [Object; 0] = [];

const MEASURING: [Object; 18] = [
    Object::highest(0x6110, 1, "Sensor type"),
    own_at(0x6110, 1, Type::Unsigned16),
    Object::highest(0x6130, 1, "Process value"),
    input(0x6130, 1, Type::Real32),
    Object::highest(0x6131, 1, "Physical unit"),
    own_at(0x6131, 1, Type::Unsigned32),
    Object::highest(0x6132, 1, "Decimal digits"),
    own_at(0x6132, 1, Type::Unsigned8),
    Object::highest(0x6150, 1, "Status"),
    input(0x6150, 1, Type::Unsigned8),
    Object::highest(0x6100, 1, "Field value"),
    input(0x6100, 1, Type::Real32),
    Object::highest(0x6139, 1, "Autotare"),
    Object::new(0x6139, 1, "Autotare", Type::Unsigned32, Access::WriteOnly).handled(),
    Object::highest(0x650D, 1, "Alarm state"),
    input(0x650D, 1, Type::Unsigned8),
    Object::highest(0x6600, 1, "Alarm states"),
    input(0x6600, 1, Type::Unsigned8),
];

const ENCODER: [Object; 9] = [
    own(0x6000, Type::Unsigned16).value(4),
    input(0x6004, 0, Type::Unsigned32),
    Object::highest(0x6020, 1, "Positions"),
    input(0x6020, 1, Type::Integer32),
    Object::highest(0x6030, 1, "Speeds"),
    input(0x6030, 1, Type::Integer16),
    fixed(0x6500, 0, Type::Unsigned16, 4),
    fixed(0x6501, 0, Type::Unsigned32, 8192),
    fixed(0x6502, 0, Type::Unsigned16, 4096),
];

const LIFT: [Object; 9] = [
    Object::highest(0x6000, 1, "Virtual devices"),
    fixed(0x6000, 1, Type::Unsigned16, 1),
    own(0x6001, Type::Unsigned8),
    Object::highest(0x63B0, 1, "Area state"),
    input(0x63B0, 1, Type::Unsigned8),
    Object::highest(0x63B4, 1, "Low limit"),
    own_at(0x63B4, 1, Type::Integer32),
    Object::highest(0x63B8, 1, "High limit"),
    own_at(0x63B8, 1, Type::Integer32),
];

const IO: [Object; 8] = [
    Object::highest(0x6000, 1, "Digital inputs"),
    input(0x6000, 1, Type::Unsigned8),
    Object::highest(0x6200, 1, "Digital outputs"),
    own_at(0x6200, 1, Type::Unsigned8),
    Object::highest(0x6401, 1, "Analogue inputs"),
    input(0x6401, 1, Type::Integer16),
    Object::highest(0x6411, 1, "Analogue outputs"),
    own_at(0x6411, 1, Type::Integer16),
];

/// The rows of the device of a profile.
pub(super) fn table(profile: Option<Profile>) -> Table {
    match profile {
        None => device!(0, NOTHING),
        Some(Profile::Measuring) => device!(404, MEASURING),
        Some(Profile::Encoder) => device!(406, ENCODER),
        Some(Profile::Lift) => device!(417, LIFT),
        Some(Profile::Io) => device!(0x000F_0191, IO),
    }
}

/// The data sheet of a device of a profile, as the library writes it and the reader of this crate reads it.
pub(super) fn sheet(profile: Option<Profile>) -> eds::Eds {
    let mut text = String::new();
    let info = canopen::eds::DeviceInfo::new("Test", "a device");
    canopen::eds::write(table(profile).0, &info, &mut text).expect("a string");
    eds::Eds::from_bytes(text.as_bytes()).expect("a data sheet")
}

/// The stored parameters, by group.
#[derive(Default)]
pub(super) struct App {
    stored: [Vec<u8>; Group::ALL.len()],
}

impl Application for App {
    fn write(&mut self, entry: &Entry, bytes: &[u8], _: &mut [u8]) -> Result<(), canopen::sdo::Abort> {
        let is_signed = entry.index() != 0x6139 || bytes == b"tare";
        if is_signed { Ok(()) } else { Err(canopen::sdo::Abort::NotStored) }
    }

    fn stored(&self, group: Group) -> Stored<'_> {
        Stored { packed: &self.stored[group as usize], soundness: Soundness::Whole }
    }
}

/// The size of the largest dictionary image, in bytes.
const SIZE: usize = 2048;
/// Sizes that suffice for every dictionary.
const ROOM: Sizes =
    Sizes { image: SIZE, tpdos: 8, rpdos: 8, watches: 4, scanned: 48, servers: 0, services: Services::ALL };

/// The library's device with the additions.
pub(super) struct Whole {
    dictionary: &'static Dictionary,
    device: canopen::device!(App, room: ROOM),
    out: Answers,
    is_started: bool,
    toggle: bool,
    /// The time at which the master counts as lost.
    life: Instant,
    produces_sync: bool,
    next_sync: Instant,
    counter: u8,
}

impl Whole {
    pub(super) fn new(profile: Option<Profile>) -> Whole {
        let dictionary = table(profile).1;
        Whole {
            dictionary,
            device: Device::new(dictionary, NodeId::new(ID), App::default()),
            out: Answers::default(),
            is_started: false,
            toggle: false,
            life: Instant::NEVER,
            produces_sync: false,
            next_sync: Instant::NEVER,
            counter: 1,
        }
    }

    pub(super) fn state(&self) -> canopen::nmt::State {
        self.device.state()
    }

    /// Clears the stored parameters.
    pub(super) fn forget(&mut self) {
        self.device.application_mut().stored = Default::default();
    }

    /// The frames that were sent since the last call.
    pub(super) fn take(&mut self) -> Vec<Frame> {
        std::mem::take(&mut self.out.0)
    }

    fn number(&self, index: u16) -> u32 {
        let field = self.dictionary.field(index, 0);
        let bytes = field.get(self.device.image());
        bytes.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte))
    }

    pub(super) fn receive(&mut self, frame: &Frame, now: Instant) {
        if frame.is_remote() && frame.id() == 0x700 + u16::from(ID) {
            return self.guard(now);
        }
        if let Some(answer) = self.structure(frame) {
            return self.out.0.push(answer);
        }
        let frame = self.sync_cob_id(frame, now);
        let next = self.device.on_frame(&frame, now, &mut self.out);
        self.follow(next, now);
        let next = self.device.poll(now, &mut self.out);
        self.follow(next, now);
        if self.produces_sync {
            self.show_producer();
        }
    }

    pub(super) fn poll(&mut self, now: Instant) -> Instant {
        if !std::mem::replace(&mut self.is_started, true) {
            let next = self.device.start(now, &mut self.out);
            self.follow(next, now);
        }
        self.miss_master(now);
        self.produce(now);
        let next = self.device.poll(now, &mut self.out);
        self.follow(next, now).min(self.life).min(self.next_sync)
    }

    fn follow(&mut self, mut next: Next, now: Instant) -> Instant {
        while let Some(action) = next.action {
            match action {
                Action::ResetNode | Action::ResetCommunication => {
                    (self.toggle, self.life, self.produces_sync) = (false, Instant::NEVER, false);
                    self.next_sync = Instant::NEVER;
                    next = self.device.start(now, &mut self.out);
                    continue;
                }
                Action::Store(job) => {
                    self.store(job);
                    let _ = self.device.finish(Ok(()), now, &mut self.out);
                }
                _ => (),
            }
            next = self.device.poll(now, &mut self.out);
        }
        next.due()
    }

    fn store(&mut self, job: Job) {
        let (groups, keeps) = match job {
            Job::Store(groups) => (groups, true),
            Job::Restore(groups) => (groups, false),
            _ => return,
        };
        for group in groups.iter() {
            let mut buffer = [0; SIZE];
            let packed = self.dictionary.pack(group, self.device.node_id(), self.device.image(), &mut buffer);
            let len = if keeps { packed.expect("room") } else { 0 };
            self.device.application_mut().stored[group as usize] = buffer[..len].to_vec();
        }
    }

    fn guard(&mut self, now: Instant) {
        if self.number(0x1017) != 0 {
            return;
        }
        let answer = self.device.state().code() | u8::from(self.toggle) << 7;
        self.toggle = !self.toggle;
        self.out.0.push(Frame::new(0x700 + u16::from(ID), &[answer]).expect("a frame"));
        let life = self.number(0x100C) * self.number(0x100D);
        self.life = if life == 0 { Instant::NEVER } else { now + Duration::from_millis(life.into()) };
    }

    fn miss_master(&mut self, now: Instant) {
        if now >= self.life {
            self.life = Instant::NEVER;
            let lost = [0x30, 0x81, 0x11, 0, 0, 0, 0, 0];
            self.out.0.push(Frame::new(0x80 + u16::from(ID), &lost).expect("a frame"));
        }
    }

    /// The answer for sub-index FFh of 1018h: a record.
    fn structure(&self, frame: &Frame) -> Option<Frame> {
        let is_asked =
            frame.id() == 0x600 + u16::from(ID) && frame.data().starts_with(&[0x40, 0x18, 0x10, 0xFF]);
        let answer = [0x43, 0x18, 0x10, 0xFF, 0x09, 0x23, 0, 0];
        (is_asked && self.state().has_services())
            .then(|| Frame::new(0x580 + u16::from(ID), &answer).expect("a frame"))
    }

    /// Bit 30 of 1005h is kept here, because the library's device is no SYNC producer.
    fn sync_cob_id(&mut self, frame: &Frame, now: Instant) -> Frame {
        let is_written =
            frame.id() == 0x600 + u16::from(ID) && frame.data().starts_with(&[0x23, 0x05, 0x10, 0]);
        if !is_written || frame.len() != 8 || !self.state().has_services() {
            return *frame;
        }
        let mut data = [0; 8];
        data.copy_from_slice(frame.data());
        self.produces_sync = data[7] & 0x40 != 0;
        self.next_sync = if self.produces_sync { now } else { Instant::NEVER };
        data[7] &= !0x40;
        Frame::new(frame.id(), &data).expect("a frame")
    }

    /// Adds bit 30 to the answer of an upload of 1005h.
    fn show_producer(&mut self) {
        for frame in &mut self.out.0 {
            if frame.id() == 0x580 + u16::from(ID) && frame.data().starts_with(&[0x43, 0x05, 0x10, 0]) {
                let mut data = [0; 8];
                data.copy_from_slice(frame.data());
                data[7] |= 0x40;
                *frame = Frame::new(frame.id(), &data).expect("a frame");
            }
        }
    }

    fn produce(&mut self, now: Instant) {
        if !self.produces_sync || now < self.next_sync {
            return;
        }
        let period = self.number(0x1006);
        self.next_sync = now + Duration(u64::from(if period == 0 { 10_000 } else { period }));
        if period == 0 || !self.state().has_services() {
            return;
        }
        let highest = u8::try_from(self.number(0x1019)).unwrap_or(0);
        let data = if highest == 0 { vec![] } else { vec![self.counter] };
        self.counter = if self.counter >= highest { 1 } else { self.counter + 1 };
        self.out.0.push(Frame::new(0x80, &data).expect("a frame"));
    }
}
