//! A node with a program that can be replaced (CiA 302-3), on the server of the crate `canopen`.
//!
//! The node behaves as devices in the field do. It does not acknowledge stopping and starting, and then answers in its
//! new state. While it erases the flash, it serves SDO.

use crate::wire::Answers;
use canopen::dictionary::{Access, DefaultValue, Dictionary, Entry, Object, Type};
use canopen::sdo::{Abort, Multiplexer, Response};
use canopen::{Application, Device, Duration, Frame, Instant, NodeId, Part, Transmit};
use nodectl::bus::Station;
use update::{Authorisation, Pair};

/// 1018h:4.
const SERIAL_NUMBER: u32 = 99;

const fn read_only(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadOnly)
}

const ROWS: &[Object] = &[
    read_only(0x1000, 0, Type::Unsigned32),
    read_only(0x1001, 0, Type::Unsigned8),
    Object::new(0x1008, 0, "", Type::VisibleString(32), Access::Const).default(DefaultValue::Text("loader")),
    read_only(0x100A, 0, Type::VisibleString(32)),
    Object::new(0x1017, 0, "", Type::Unsigned16, Access::ReadWrite),
    Object::highest(0x1018, 4, ""),
    read_only(0x1018, 1, Type::Unsigned32).value(7),
    read_only(0x1018, 2, Type::Unsigned32).value(2),
    read_only(0x1018, 3, Type::Unsigned32).value(0x0001_0000),
    read_only(0x1018, 4, Type::Unsigned32).value(SERIAL_NUMBER as i64),
    Object::highest(0x1F50, 1, ""),
    Object::new(0x1F50, 1, "", Type::Domain, Access::ReadWrite),
    Object::highest(0x1F51, 1, ""),
    Object::new(0x1F51, 1, "", Type::Unsigned8, Access::ReadWrite).handled(),
    Object::highest(0x1F56, 1, ""),
    read_only(0x1F56, 1, Type::Unsigned32),
    Object::highest(0x1F57, 1, ""),
    read_only(0x1F57, 1, Type::Unsigned32),
    Object::highest(0x2002, 2, ""),
    read_only(0x2002, 1, Type::Unsigned8),
    Object::new(0x2002, 2, "", Type::Unsigned32, Access::ReadWrite).handled(),
    Object::highest(0x2003, 3, ""),
    read_only(0x2003, 1, Type::Unsigned8),
    read_only(0x2003, 2, Type::Unsigned64),
    Object::new(0x2003, 3, "", Type::Unsigned64, Access::WriteOnly).handled(),
    Object::highest(0x2004, 1, ""),
    read_only(0x2004, 1, Type::Unsigned32).value(42),
];

const DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The time from a command to the first answer in the new state.
const RESTART: Duration = Duration::from_millis(200);
/// The time of erasing and of a copy, and below it the time of checking the downloaded program.
const ERASE: Duration = Duration::from_millis(1500);
const CHECK: Duration = Duration::from_millis(100);

/// The value of 1F57h of a program on trial: code 73.
const ON_TRIAL: u32 = 73 << 1;

/// The program, and the state of the loader.
#[derive(Clone, Debug)]
pub(crate) struct Flash {
    /// The downloaded program. An image is its version and a newline, then any bytes.
    pub(crate) program: Vec<u8>,
    /// Whether the node supports block transfers.
    pub(crate) has_blocks: bool,
    /// The value of 1F57h after a download; 0 for a valid program.
    pub(crate) verdict: u32,
    /// The number of times that the flash was erased.
    pub(crate) erased: usize,
    /// Whether new programs are on trial, and whether the present program is.
    pub(crate) has_trials: bool,
    pub(crate) is_on_trial: bool,
    /// The program that runs after a rollback.
    pub(crate) takes_back: Option<Vec<u8>>,
    /// The key that authorises a change of the program, and the state of the challenge since this start.
    key: Option<[u8; 32]>,
    authorisation: Authorisation,
    /// The received commands of 1F51h.
    pub(crate) commands: Vec<u8>,
    status: u32,
    busy_until: Instant,
    runs: bool,
    /// The state after the restart in progress.
    next: Option<bool>,
    /// When the loader has finished a copy, and starts the program by itself.
    copied: Option<Instant>,
    /// The loader starts its program by itself just before it receives this command.
    pub(crate) starts_before: Option<u8>,
    /// The program that another master downloads as soon as the program is stopped. It is on trial and cannot be cleared.
    pub(crate) other_download: Option<Vec<u8>>,
    /// How often the node loses its power just after it has accepted the command to stop its program.
    pub(crate) power_cuts: usize,
    now: Instant,
}

impl Flash {
    /// Makes a new challenge at a start.
    pub(crate) fn challenge(&mut self, is_answered: bool) {
        let noise = [self.now.0 as u32, self.commands.len() as u32];
        let pair = self.key.map(|key| Pair::new(&key, &noise, SERIAL_NUMBER));
        self.authorisation = Authorisation::new(pair, is_answered);
    }

    fn admit(&self) -> Result<(), Abort> {
        if self.authorisation.is_open() { Ok(()) } else { Err(Abort::DeviceState) }
    }

    fn command(&mut self, command: u8) -> Result<(), Abort> {
        self.admit()?;
        self.commands.push(command);
        self.runs |= self.starts_before.take_if(|before| *before == command).is_some();
        match (command, self.runs) {
            (0, true) => {
                self.next = Some(self.power_cuts > 0);
                if let Some(program) = self.other_download.take() {
                    (self.program, self.status, self.is_on_trial) = (program, ON_TRIAL, true);
                }
                self.power_cuts = self.power_cuts.saturating_sub(1);
            }
            (0, false) => (),
            (1, false) if self.program.is_empty() => return Err(Abort::DeviceState),
            (1, false) => {
                (self.next, self.is_on_trial) = (Some(true), self.has_trials);
                if let Some(program) = self.takes_back.take() {
                    (self.program, self.status) = (program, 0x0001_0090);
                }
            }
            (3, false) if self.status == ON_TRIAL => return Err(Abort::DeviceState),
            (3, false) => {
                (self.program, self.status, self.erased) = (Vec::new(), 0, self.erased + 1);
                self.busy_until = self.now + ERASE;
            }
            _ => return Err(Abort::DeviceState),
        }
        Ok(())
    }

    fn version(&self) -> &[u8] {
        self.program.split(|&byte| byte == b'\n').next().unwrap_or(&[])
    }
}

/// The value of 1F56h. Any function of the program will do.
pub(crate) fn identification(program: &[u8]) -> u32 {
    program.iter().fold(1, |sum, &byte| sum.wrapping_mul(31).wrapping_add(byte.into()))
}

impl Application for Flash {
    fn write(&mut self, entry: &Entry, bytes: &[u8], _: &mut [u8]) -> Result<(), Abort> {
        match (entry.index(), bytes) {
            (0x2003, _) => {
                let is_right = self.authorisation.answer(bytes.try_into().expect("eight bytes"));
                if is_right { Ok(()) } else { Err(Abort::InvalidValue) }
            }
            (0x2002, _) if !self.authorisation.is_open() => Err(Abort::DeviceState),
            (0x2002, b"conf") if self.is_on_trial => {
                self.is_on_trial = false;
                Ok(())
            }
            (0x2002, _) => Err(Abort::DeviceState),
            _ => self.command(bytes[0]),
        }
    }

    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(&self.program)
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.admit()?;
        if self.runs || self.now < self.busy_until {
            return Err(Abort::DeviceState);
        }
        match part {
            Part::Begin(_) => self.program.clear(),
            Part::Data(_, bytes) => self.program.extend_from_slice(bytes),
            Part::End(_) => (self.status, self.busy_until) = (self.verdict, self.now + CHECK),
        }
        Ok(())
    }
}

/// A node that can be switched off.
pub(crate) struct Loader {
    id: NodeId,
    device: canopen::device!(Flash, ROWS),
    /// The time at which the node is up again; `NEVER` while it is off.
    up: Instant,
    is_started: bool,
}

impl Loader {
    /// A node that runs this program.
    pub(crate) fn new(id: u8, program: &[u8]) -> Loader {
        let id = NodeId::new(id).expect("a node-ID");
        let flash = Flash {
            program: program.to_vec(),
            has_blocks: true,
            verdict: 0,
            erased: 0,
            has_trials: false,
            is_on_trial: false,
            takes_back: None,
            key: None,
            authorisation: Authorisation::default(),
            commands: Vec::new(),
            status: 0,
            busy_until: Instant(0),
            runs: !program.is_empty(),
            next: None,
            copied: None,
            starts_before: None,
            power_cuts: 0,
            other_download: None,
            now: Instant(0),
        };
        Loader { id, device: Device::new(&DICTIONARY, id, flash), up: Instant(0), is_started: false }
    }

    pub(crate) fn id(&self) -> NodeId {
        self.id
    }

    pub(crate) fn flash(&mut self) -> &mut Flash {
        self.device.application_mut()
    }

    /// Switches the node off until an instant. An erased or half written flash is not changed.
    pub(crate) fn switch_off(&mut self, until: Instant) {
        let runs = self.flash().runs;
        self.flash().challenge(false);
        self.restart(runs, until);
    }

    /// Switches the node off until an instant, within the copy of a new program: its loader then finishes the copy, and
    /// starts the program.
    pub(crate) fn switch_off_within_copy(&mut self, until: Instant) {
        let copied = until + ERASE;
        (self.flash().copied, self.flash().busy_until) = (Some(copied), copied);
        self.switch_off(until);
    }

    /// Demands an authorisation by this key from now on.
    pub(crate) fn set_key(&mut self, key: [u8; 32]) {
        self.flash().key = Some(key);
        self.flash().challenge(false);
    }

    fn restart(&mut self, runs: bool, up: Instant) {
        let flash = Flash { runs, next: None, ..self.flash().clone() };
        self.device = Device::new(&DICTIONARY, self.id, flash);
        (self.up, self.is_started) = (up, false);
    }

    /// Updates the objects from the state.
    fn publish(&mut self, now: Instant) {
        let flash = self.flash();
        let device_type = if flash.runs { 0x0002_0194_u32 } else { 0x424F_4F54 };
        let version = if flash.runs { flash.version().to_vec() } else { b"loader 1".to_vec() };
        let status = if now < flash.busy_until { 1 } else { flash.status };
        let identification = if flash.program.is_empty() { 0 } else { identification(&flash.program) };
        let (runs, is_on_trial, authorisation) = (flash.runs, flash.is_on_trial, flash.authorisation);
        self.device.show(|_, image| {
            DICTIONARY.field(0x1000, 0).set(image, &device_type.to_le_bytes());
            DICTIONARY.field(0x100A, 0).set(image, &version);
            DICTIONARY.field(0x2002, 1).set(image, &[u8::from(is_on_trial)]);
            DICTIONARY.field(0x2003, 1).set(image, &[authorisation.state()]);
            DICTIONARY.field(0x2003, 2).set(image, &authorisation.challenge());
            DICTIONARY.field(0x1F51, 1).set(image, &[u8::from(runs)]);
            DICTIONARY.field(0x1F56, 1).set(image, &identification.to_le_bytes());
            DICTIONARY.field(0x1F57, 1).set(image, &status.to_le_bytes());
        });
    }

    fn understands(&self, frame: &Frame) -> bool {
        let is_block_download = frame.data().first().is_some_and(|byte| byte >> 5 == 6);
        self.device.application().has_blocks || !is_block_download
    }
}

impl Station for Loader {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.poll(now, out);
        if now < self.up || frame.id() != 0x600 + u16::from(self.id.get()) {
            return;
        }
        self.device.application_mut().now = now;
        let is_upload = frame.data().first().is_some_and(|byte| byte >> 5 == 2);
        if is_upload {
            self.publish(now);
        }
        let mut answers = Answers::default();
        if self.understands(frame) {
            let _ = self.device.on_service_frame(frame, now, &mut answers);
        } else {
            let at = Multiplexer { index: 0x1F50, sub: 1 };
            let refusal = Response::Abort(at, Abort::Command.code()).encode();
            answers.0.extend(Frame::new(0x580 + u16::from(self.id.get()), &refusal));
        }
        // A command that changes the program is not acknowledged.
        match self.flash().next {
            Some(runs) => {
                // The master that has stopped the program needs no second authorisation.
                self.flash().challenge(!runs);
                self.restart(runs, now + RESTART);
            }
            None => answers.0.into_iter().for_each(|frame| out.send(frame).expect("room")),
        }
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if self.flash().copied.take_if(|copied| *copied <= now).is_some() {
            self.restart(true, now + RESTART);
        }
        if now < self.up {
            return self.up;
        }
        if !std::mem::replace(&mut self.is_started, true) {
            let _ = self.device.start(now, out);
        }
        let copied = self.flash().copied.unwrap_or(Instant::NEVER);
        self.device.poll(now, out).due().min(copied)
    }
}
