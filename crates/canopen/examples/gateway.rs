//! A gateway on Linux between a bus and a host: 512 PDOs in each direction, 127 monitored nodes and their EMCYs, a second
//! SDO server, and an SDO client for the host.
//!
//! ```text
//! gateway --eds FILE            writes its data sheet
//! gateway HOST:PORT BUS NODE    runs on a bus of a socketcand server, such as
//!                               `cargo sim -- --socketcand 127.0.0.1:29536`
//! ```
//!
//! The host is on standard input and output:
//!
//! | input | |
//! |---|---|
//! | `set 512 7` | TPDO 512 has the value 7 |
//! | `read 9 1008 0` | uploads 1008h:0 of node 9 |
//!
//! | output | |
//! |---|---|
//! | `received 512 7` | RPDO 512 with the value 7 |
//! | `node 9 Operational`, `lost 9` | the state of a monitored node; its heartbeat is missing |
//! | `emcy 9 8130` | an EMCY of node 9 |
//! | `value 492f4f`, `failed: …` | the result of an upload |

#![allow(clippy::large_const_arrays, reason = "only the compiler evaluates the rows")]

#[path = "socketcand/command_line.rs"]
mod command_line;
mod socketcand;

use std::io::{self, Write};
use std::sync::mpsc::Receiver;

use canopen::client::sdo::{Options, Sink, Upload};
use canopen::client::{Service, Step};
use canopen::dictionary::{Access, Dictionary, Entry, Field, Mapping, Object, Type};
use canopen::emcy::Message;
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Device, Fault, Frame, Instant, Next, NodeId, Reset, Transmit, objects};
use socketcand::{Bus, Product};

// ------------------------------------------------------------------------------------------------- object dictionary

const PDOS: usize = 512;
const TO_BUS: u16 = 0x2000;
const FROM_BUS: u16 = 0x3000;

/// One UNSIGNED32 for each PDO.
const fn values(first: u16, name: &'static str, access: Access, mapping: Mapping) -> [[Object; 1]; PDOS] {
    let mut rows = [[Object::new(first, 0, name, Type::Unsigned32, access).mappable(mapping)]; PDOS];
    let mut n = 0;
    while n < PDOS {
        rows[n][0].index = first + n as u16;
        n += 1;
    }
    rows
}

const SENT: [[Object; 1]; PDOS] = values(TO_BUS, "Value to the bus", Access::ReadOnly, Mapping::Tpdo);
const RECEIVED: [[Object; 1]; PDOS] =
    values(FROM_BUS, "Value from the bus", Access::ReadWrite, Mapping::Rpdo);
const TPDOS: [[Object; 15]; PDOS] = objects::tpdos(1, &SENT);
const RPDOS: [[Object; 13]; PDOS] = objects::rpdos(1, &RECEIVED);

#[allow(long_running_const_eval)]
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register(), objects::device_name("Gateway")],
    objects::emergency(),
    objects::heartbeat_consumer::<128>(),
    [objects::heartbeat_producer(1000)],
    objects::identity(0, 0x512, 0x0001_0000),
    objects::emcy_consumer::<128>(),
    // A host with many nodes must not stop because one is missing.
    objects::with(objects::error_behaviour(1), 1, 1),
    objects::sdo_server(2),
    objects::sdo_client(1),
    TPDOS.as_flattened(),
    RPDOS.as_flattened(),
    SENT.as_flattened(),
    RECEIVED.as_flattened(),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

/// The COB-IDs of the SDO client.
const CLIENT: [Field; 2] = [DICTIONARY.field(0x1280, 1), DICTIONARY.field(0x1280, 2)];
const OFF: u32 = 1 << 31;

/// The value of a PDO, by its number from 1.
fn value(first: u16, pdo: u16) -> Option<Field> {
    DICTIONARY.find(first + pdo.checked_sub(1)?, 0).ok().as_ref().map(Entry::field)
}

// ------------------------------------------------------------------------------------------------------- application

/// The messages to the host.
struct Host;

impl Host {
    fn report(text: std::fmt::Arguments<'_>) {
        println!("{text}");
        let _ = io::stdout().flush();
    }
}

impl Application for Host {
    /// The EMCYs of all nodes are consumed.
    fn initialise(&mut self, _: Reset, image: &mut [u8]) {
        for node in 1..=127 {
            if let Ok(entry) = DICTIONARY.find(0x1028, node) {
                entry.field().set_u32(image, 0x80 + u32::from(node));
            }
        }
    }

    fn received(&mut self, rpdo: u16, image: &mut [u8]) {
        let value = value(FROM_BUS, rpdo).map_or(0, |field| field.u32(image));
        Host::report(format_args!("received {rpdo} {value}"));
    }

    fn node_state(&mut self, node: NodeId, state: State, _image: &mut [u8]) {
        Host::report(format_args!("node {} {state:?}", node.get()));
    }

    fn emergency(&mut self, node: NodeId, message: Message, _image: &mut [u8]) {
        Host::report(format_args!("emcy {} {:04X}", node.get(), message.code));
    }

    fn fault(&mut self, fault: Fault, active: bool, image: &mut [u8]) {
        if let (Fault::Heartbeat(number), true) = (fault, active)
            && let Ok(entry) = DICTIONARY.find(0x1016, number + 1)
        {
            Host::report(format_args!("lost {}", entry.field().u32(image) >> 16));
        }
    }
}

// ------------------------------------------------------------------------------------------------------- SDO client

/// The bytes of an upload.
#[derive(Default)]
struct Bytes(Vec<u8>);

impl Sink for Bytes {
    fn begin(&mut self, _size: Option<u32>) -> bool {
        self.0.clear();
        true
    }

    fn append(&mut self, bytes: &[u8]) -> bool {
        self.0.extend_from_slice(bytes);
        true
    }
}

/// The gateway, and the upload that the host waits for.
#[derive(Default)]
struct Gateway {
    upload: Option<Upload<Bytes>>,
}

type Node = canopen::device!(Host, ROWS);

impl Gateway {
    /// Points the client object to the default server of a node, and begins an upload.
    fn read(&mut self, device: &mut Node, node: u8, at: Multiplexer) -> Result<(), Abort> {
        device.show(|_, image| {
            for (field, function) in CLIENT.into_iter().zip([0x600, 0x580]) {
                field.set_u32(image, if node == 0 { OFF } else { function + u32::from(node) });
            }
        });
        let channel = device.sdo_client(1).ok_or(Abort::NoConnection)?;
        self.upload = Some(Upload::new(channel, at, Bytes::default(), Options::default()));
        Ok(())
    }

    /// Sends what the upload has to send, and reports its end.
    fn step(&mut self, bus: &mut Bus, now: Instant) {
        while let Some(upload) = &mut self.upload {
            match upload.next(now) {
                Step::Send(frame) => drop(bus.send(frame)),
                Step::Wait(_) => return,
                Step::Done(Ok(())) => {
                    let bytes = self.upload.take().map(Upload::into_sink).unwrap_or_default();
                    let text: String = bytes.0.iter().map(|byte| format!("{byte:02x}")).collect();
                    Host::report(format_args!("value {text}"));
                }
                Step::Done(Err(error)) => {
                    self.upload = None;
                    Host::report(format_args!("failed: {error}"));
                }
            }
        }
    }

    /// Carries out a line of the host.
    fn command(&mut self, line: &str, device: &mut Node) -> Option<()> {
        let mut words = line.split(' ');
        match words.next()? {
            "set" => {
                let field = value(TO_BUS, words.next()?.parse().ok()?)?;
                let number = words.next()?.parse().ok()?;
                device.show(|_, image| field.set_u32(image, number));
            }
            "read" => {
                let node = words.next()?.parse().ok()?;
                let index = u16::from_str_radix(words.next()?, 16).ok()?;
                let sub = words.next()?.parse().ok()?;
                if let Err(abort) = self.read(device, node, Multiplexer { index, sub }) {
                    Host::report(format_args!("failed: {abort:?}"));
                }
            }
            _ => return None,
        }
        Some(())
    }
}

impl Product for Gateway {
    type Definition = canopen::definition!(Host, ROWS);

    fn on_frame(&mut self, frame: &Frame, now: Instant) {
        if let Some(upload) = &mut self.upload {
            let _ = upload.on_frame(frame, now);
        }
    }

    fn cycle(&mut self, device: &mut Node, bus: &mut Bus, lines: &Receiver<String>, now: Instant) -> Next {
        for line in lines.try_iter() {
            if self.command(&line, device).is_none() {
                eprintln!("what is {line}?");
            }
        }
        self.step(bus, now);
        device.publish(now, bus, |_, _| ())
    }
}

fn main() -> io::Result<()> {
    command_line::main("Gateway", ROWS, |node| (Gateway::default(), Device::new(&DICTIONARY, node, Host)))
}
