//! A CiA 401 device on Linux: eight digital inputs and outputs and an analogue input.
//!
//! ```text
//! io_module --eds FILE            writes its data sheet
//! io_module HOST:PORT BUS NODE    runs on a bus of a socketcand server, such as
//!                                 `cargo sim -- --socketcand 127.0.0.1:29536`
//! ```
//!
//! The process is simulated on standard input and output: `inputs 5` and `analogue 1200` set the connected signals, and
//! each change of the outputs is printed as `outputs 3`.

mod socketcand;

use std::io::{self, BufRead, Write};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

use canopen::dictionary::{Access, Dictionary, Entry, Field, Group, Mapping, Object, Type};
use canopen::eds::DeviceInfo;
use canopen::nmt::State;
use canopen::{Action, Application, BusEvent, ErrorClass, Instant, Next, NodeId, objects};
use socketcand::Bus;

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

/// The places of the values, found at compile time.
const READ: Field = DICTIONARY.field(0x6000, 1);
const POLARITY_IN: Field = DICTIONARY.field(0x6002, 1);
const FILTER: Field = DICTIONARY.field(0x6003, 1);
const WRITE: Field = DICTIONARY.field(0x6200, 1);
const POLARITY_OUT: Field = DICTIONARY.field(0x6202, 1);
const ERROR_MODE: Field = DICTIONARY.field(0x6206, 1);
const ERROR_VALUE: Field = DICTIONARY.field(0x6207, 1);
const MEASURED: Field = DICTIONARY.field(0x6401, 1);
const INTERRUPT: Field = DICTIONARY.field(0x6423, 0);
const DELTA: Field = DICTIONARY.field(0x6426, 1);

// ------------------------------------------------------------------------------------------------------- application

/// Interval at which the inputs are read. `FILTER_READS`: number of equal reads for a filtered input.
const PERIOD: canopen::Duration = canopen::Duration::from_millis(10);
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
}

impl Io {
    /// Reads the inputs into the dictionary. Returns whether the analogue value has to be sent.
    fn sample(&mut self, image: &mut [u8]) -> bool {
        self.steady = if self.inputs == self.last { (self.steady + 1).min(FILTER_READS) } else { 0 };
        self.last = self.inputs;
        let slow = if self.steady < FILTER_READS { FILTER.u8(image) } else { 0 };
        self.filtered = self.filtered & slow | self.inputs & !slow;
        READ.store(image, [self.filtered ^ POLARITY_IN.u8(image)]);
        MEASURED.store(image, self.analogue.to_le_bytes());
        let change = u32::from(self.analogue.abs_diff(self.sent));
        let is_due = INTERRUPT.u8(image) != 0 && change != 0 && change >= DELTA.u32(image);
        if is_due {
            self.sent = self.analogue;
        }
        is_due
    }

    /// Applies the written outputs.
    fn write_outputs(&mut self, image: &[u8]) {
        self.set(WRITE.u8(image) ^ POLARITY_OUT.u8(image));
    }

    /// Sets the outputs to their error values, when nobody controls them any more.
    fn fail(&mut self, image: &[u8]) {
        let (mode, value) = (ERROR_MODE.u8(image), ERROR_VALUE.u8(image));
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

// --------------------------------------------------------------------------------------------------------------- main

type Device = canopen::device!(Io, ROWS);

fn now(since: std::time::Instant) -> Instant {
    Instant(u64::try_from(since.elapsed().as_micros()).unwrap_or(u64::MAX))
}

/// Runs until the connection to the bus is lost.
fn run(
    device: &mut Device,
    bus: &mut Bus,
    process: &Receiver<String>,
    start: std::time::Instant,
) -> io::Result<std::convert::Infallible> {
    let mut next = device.start(now(start), bus);
    let mut sample = now(start);
    loop {
        let patience = next.due().min(sample).0.saturating_sub(now(start).0);
        let frame = bus.receive(Duration::from_micros(patience))?;
        next = match frame {
            Some(frame) => device.on_frame(&frame, now(start), bus),
            None => device.poll(now(start), bus),
        };
        while let Some(action) = next.action {
            next = match action {
                Action::ResetNode | Action::ResetCommunication => device.start(now(start), bus),
                // There are no acceptance filters, only one bit rate, no bootloader and no memory.
                _ => device.poll(now(start), bus),
            };
        }
        if now(start) >= sample {
            sample = now(start) + PERIOD;
            next = read_process(device, bus, process, now(start));
        }
    }
}

/// Takes the connected signals, and publishes the resulting values.
fn read_process(device: &mut Device, bus: &mut Bus, process: &Receiver<String>, now: Instant) -> Next {
    for line in process.try_iter() {
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

fn main() -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (address, bus, node) = match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["--eds", file] => {
            let mut sheet = String::new();
            let device = DeviceInfo { vendor: "none", product: "I/O module" };
            canopen::eds::write(ROWS, &device, &mut sheet).map_err(io::Error::other)?;
            return std::fs::write(file, sheet);
        }
        [address, bus, node] => (address, bus, node.parse().ok().and_then(NodeId::new)),
        _ => return Err(io::Error::other("usage: io_module --eds FILE | HOST:PORT BUS NODE")),
    };
    let (lines, process) = channel();
    std::thread::spawn(move || {
        io::stdin().lock().lines().map_while(Result::ok).try_for_each(|line| lines.send(line))
    });
    let (mut device, start) = (Device::new(&DICTIONARY, node, Io::default()), std::time::Instant::now());
    loop {
        if let Ok(mut bus) = Bus::open(address, bus) {
            let Err(error) = run(&mut device, &mut bus, &process, start);
            eprintln!("the bus is gone: {error}");
            // For the outputs, a lost connection is the same as bus-off.
            let _ = device.on_bus(BusEvent::BusOff, now(start));
        }
        std::thread::sleep(Duration::from_millis(100));
    }
}
