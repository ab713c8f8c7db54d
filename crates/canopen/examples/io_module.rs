//! A CiA 401 device on Linux: eight digital inputs and outputs and an analogue input. It stores its parameters in files.
//!
//! ```text
//! io_module --eds FILE            writes its data sheet
//! io_module HOST:PORT BUS NODE [FILE]
//!                                 runs on a bus of a socketcand server, such as
//!                                 `cargo sim -- --socketcand 127.0.0.1:29536`
//!                                 and stores parameters in FILE.2 (communication) and FILE.3 (application)
//! ```
//!
//! The process is simulated on standard input and output: `inputs 5` and `analogue 1200` set the connected signals, and
//! each change of the outputs is printed as `outputs 3`.

mod socketcand;

use std::fs;
use std::io::{self, Write};
use std::path::PathBuf;
use std::sync::mpsc::Receiver;

use canopen::dictionary::{
    Access, Dictionary, Entry, Group, Groups, Mapping, Object, Type, Variable, packed_size,
};
use canopen::eds::DeviceInfo;
use canopen::nmt::State;
use canopen::sdo::Abort;
use canopen::{Application, Device, ErrorClass, Instant, Job, Next, NodeId, Soundness, Stored, objects};
use socketcand::{Bus, Product, run};

// ------------------------------------------------------------------------------------------------- object dictionary

/// A parameter of all eight channels, one bit each.
const fn bits(index: u16, name: &'static str, default: i64) -> [Object; 2] {
    let row = Object::new(index, 1, name, Type::Unsigned8, Access::ReadWrite);
    [Object::highest(index, 1, name), row.value(default).stored(Group::Application)]
}

const INPUTS: Object =
    Object::new(0x6000, 1, "Inputs 1 to 8", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo);
const OUTPUTS: Object =
    Object::new(0x6200, 1, "Outputs 1 to 8", Type::Unsigned8, Access::ReadWrite).mappable(Mapping::Rpdo);
const ANALOGUE: Object =
    Object::new(0x6401, 1, "Analogue input 1", Type::Integer16, Access::ReadOnly).mappable(Mapping::Tpdo);

const ROWS: &[Object] = canopen::rows!(
    // CiA 401: digital inputs, digital outputs and analogue inputs.
    [objects::device_type(0x0007_0191), objects::error_register()],
    objects::error_field::<11>(),
    objects::sync_consumer(),
    [objects::device_name("I/O module"), objects::software_version(env!("CARGO_PKG_VERSION"))],
    objects::store_parameters(),
    objects::restore_parameters(),
    objects::emergency(),
    objects::heartbeat_consumer::<3>(),
    [objects::heartbeat_producer(200)],
    objects::identity(0, 0x401, 0x0001_0000),
    objects::error_behaviour(1),
    objects::rpdo(1, &[OUTPUTS]),
    objects::tpdo(1, &[INPUTS]),
    // Type 254: the application decides when to send, by the delta value.
    objects::with(objects::tpdo(2, &[ANALOGUE]), 2, 254),
    [Object::highest(0x6000, 1, "Read input 8 bit"), INPUTS],
    bits(0x6002, "Polarity input 8 bit", 0),
    bits(0x6003, "Filter constant input 8 bit", 0),
    [Object::highest(0x6200, 1, "Write output 8 bit"), OUTPUTS],
    bits(0x6202, "Change polarity output 8 bit", 0),
    bits(0x6206, "Error mode output 8 bit", 0xFF),
    bits(0x6207, "Error value output 8 bit", 0),
    [Object::highest(0x6401, 1, "Read analogue input 16 bit"), ANALOGUE],
    [Object::new(0x6423, 0, "Analogue input global interrupt enable", Type::Boolean, Access::ReadWrite)
        .stored(Group::Application)],
    [
        Object::highest(0x6426, 1, "Analogue input interrupt delta"),
        Object::new(0x6426, 1, "Delta 1", Type::Unsigned32, Access::ReadWrite).stored(Group::Application),
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The places of the values, found at compile time, with their types.
const READ: Variable<u8> = DICTIONARY.variable(0x6000, 1);
const POLARITY_IN: Variable<u8> = DICTIONARY.variable(0x6002, 1);
const FILTER: Variable<u8> = DICTIONARY.variable(0x6003, 1);
const WRITE: Variable<u8> = DICTIONARY.variable(0x6200, 1);
const POLARITY_OUT: Variable<u8> = DICTIONARY.variable(0x6202, 1);
const ERROR_MODE: Variable<u8> = DICTIONARY.variable(0x6206, 1);
const ERROR_VALUE: Variable<u8> = DICTIONARY.variable(0x6207, 1);
const MEASURED: Variable<i16> = DICTIONARY.variable(0x6401, 1);
const INTERRUPT: Variable<u8> = DICTIONARY.variable(0x6423, 0);
const DELTA: Variable<u32> = DICTIONARY.variable(0x6426, 1);

// ------------------------------------------------------------------------------------------------------- application

/// Number of equal reads for a filtered input. The inputs are read every 10 ms.
const FILTER_READS: u8 = 5;

/// The pins, and the state between the pins and the objects.
#[derive(Default)]
struct Io {
    inputs: u8,
    analogue: i16,
    outputs: u8,
    /// The inputs at the last read, the number of equal reads, and the filtered inputs.
    last: u8,
    steady: u8,
    filtered: u8,
    /// The analogue value of the last TPDO.
    sent: i16,
    /// The stored values of the communication and the application group, as the files had them at the start.
    packed: [Vec<u8>; 2],
    /// The groups whose file could not be read.
    lost: Groups,
}

impl Io {
    /// Reads the inputs into the dictionary. Returns whether the analogue value has to be sent.
    fn sample(&mut self, image: &mut [u8]) -> bool {
        self.steady = if self.inputs == self.last { (self.steady + 1).min(FILTER_READS) } else { 0 };
        self.last = self.inputs;
        let slow = if self.steady < FILTER_READS { FILTER.get(image) } else { 0 };
        self.filtered = self.filtered & slow | self.inputs & !slow;
        READ.set(image, self.filtered ^ POLARITY_IN.get(image));
        MEASURED.set(image, self.analogue);
        let change = u32::from(self.analogue.abs_diff(self.sent));
        let is_due = INTERRUPT.get(image) != 0 && change != 0 && change >= DELTA.get(image);
        if is_due {
            self.sent = self.analogue;
        }
        is_due
    }

    /// Applies the written outputs.
    fn write_outputs(&mut self, image: &[u8]) {
        self.set(WRITE.get(image) ^ POLARITY_OUT.get(image));
    }

    /// Sets the outputs to their error values, when no master controls them any more.
    fn fail(&mut self, image: &[u8]) {
        let (mode, value) = (ERROR_MODE.get(image), ERROR_VALUE.get(image));
        self.set(self.outputs & !mode | value & mode);
    }

    fn set(&mut self, outputs: u8) {
        if std::mem::replace(&mut self.outputs, outputs) != outputs {
            println!("outputs {outputs}");
            let _ = io::stdout().flush();
        }
    }
}

impl Application for Io {
    fn stored(&self, group: Group) -> Stored<'_> {
        let soundness = if self.lost.contains(group) { Soundness::Lost } else { Soundness::Whole };
        Stored { packed: self.packed.get(group as usize).map_or(&[], Vec::as_slice), soundness }
    }

    fn written(&mut self, entry: &Entry, image: &mut [u8]) {
        if matches!(entry.index(), 0x6200 | 0x6202) {
            self.write_outputs(image);
        }
    }

    fn received(&mut self, _rpdo: u16, image: &mut [u8]) {
        self.write_outputs(image);
    }

    fn state(&mut self, state: State, image: &mut [u8]) {
        match state {
            State::Stopped => self.fail(image),
            State::Operational => self.write_outputs(image),
            State::Initialising | State::PreOperational => (),
        }
    }

    fn error(&mut self, _class: ErrorClass, image: &mut [u8]) {
        self.fail(image);
    }
}

// ------------------------------------------------------------------------------------------------------------ storing

/// The device, and the files of its parameters.
struct Module {
    file: Option<String>,
}

/// Room for the values of either group.
const ROOM: usize = packed_size(ROWS, Group::Communication) + packed_size(ROWS, Group::Application);

impl Module {
    /// The file of a group.
    fn file(&self, group: Group) -> Option<PathBuf> {
        self.file.as_ref().map(|file| format!("{file}.{}", group.sub()).into())
    }

    /// Reads the files.
    fn load(&self, io: &mut Io) {
        for group in [Group::Communication, Group::Application] {
            let Some(file) = self.file(group).filter(|file| file.exists()) else { continue };
            let content = fs::read(file);
            io.lost.set(group, content.is_err());
            io.packed[group as usize] = content.unwrap_or_default();
        }
    }

    /// Stores the present values of a group.
    fn save(&self, group: Group, device: &mut Node) -> Result<(), Abort> {
        let file = self.file(group).ok_or(Abort::NotStored)?;
        let mut packed = vec![0; ROOM];
        let len = DICTIONARY.pack(group, device.node_id(), device.image(), &mut packed);
        packed.truncate(len.map_err(|_| Abort::OutOfMemory)?);
        // A power cut leaves the file before or the new one.
        let new = file.with_extension("new");
        fs::write(&new, &packed).and_then(|()| fs::rename(new, file)).map_err(|_| Abort::Hardware)?;
        device.application_mut().packed[group as usize] = packed;
        Ok(())
    }

    /// Erases the stored values of a group. Its defaults are in use from the next reset on.
    fn erase(&self, group: Group, device: &mut Node) -> Result<(), Abort> {
        let file = self.file(group).ok_or(Abort::NotStored)?;
        if file.exists() {
            fs::remove_file(file).map_err(|_| Abort::Hardware)?;
        }
        device.application_mut().packed[group as usize].clear();
        Ok(())
    }
}

// --------------------------------------------------------------------------------------------------------------- main

type Node = canopen::device!(Io, ROWS);

impl Product for Module {
    type Definition = canopen::definition!(Io, ROWS);

    fn store(&mut self, device: &mut Node, job: Job) -> Result<(), Abort> {
        match job {
            Job::Store(groups) => groups.iter().try_for_each(|group| self.save(group, device)),
            Job::Restore(groups) => groups.iter().try_for_each(|group| self.erase(group, device)),
            _ => Err(Abort::NotStored),
        }
    }

    fn cycle(&mut self, device: &mut Node, bus: &mut Bus, lines: &Receiver<String>, now: Instant) -> Next {
        for line in lines.try_iter() {
            let io = device.application_mut();
            match line.split_once(' ') {
                Some(("inputs", value)) => io.inputs = value.parse().unwrap_or(io.inputs),
                Some(("analogue", value)) => io.analogue = value.parse().unwrap_or(io.analogue),
                _ => eprintln!("what is {line}?"),
            }
        }
        let mut is_due = false;
        let next = device.publish(now, bus, |io, image| is_due = io.sample(image));
        if is_due { device.send_tpdo(2, now, bus) } else { next }
    }
}

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let (address, bus, node, file) = match arguments[..] {
        ["--eds", file] => {
            let mut sheet = String::new();
            let device = DeviceInfo::new("none", "I/O module");
            canopen::eds::write(ROWS, &device, &mut sheet).map_err(io::Error::other)?;
            return fs::write(file, sheet);
        }
        [address, bus, node] => (address, bus, node, None),
        [address, bus, node, file] => (address, bus, node, Some(file.into())),
        _ => return Err(io::Error::other("usage: io_module --eds FILE | HOST:PORT BUS NODE [FILE]")),
    };
    let (module, mut io) = (Module { file }, Io::default());
    module.load(&mut io);
    let device = Device::new(&DICTIONARY, node.parse().ok().and_then(NodeId::new), io);
    run(module, device, address, bus)
}
