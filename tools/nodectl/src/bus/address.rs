//! The address of a bus on the command line.

use std::fmt;
use std::io;
use std::str::FromStr;

use thiserror::Error;

use super::slcan::Slcan;
use super::socketcand::Socketcand;
use super::{Bus, BusError};

/// The port of a socketcand daemon where the address has none.
const SOCKETCAND_PORT: u16 = 29_536;

/// The address of a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// `socketcan:can0`, an interface of this host (Linux).
    SocketCan(String),
    /// `socketcand://host:port/bus`, a socketcand daemon or `cargo sim`.
    Socketcand {
        /// Name or number of the host.
        host: String,
        /// TCP port.
        port: u16,
        /// Name of the bus on that host.
        bus: String,
    },
    /// `slcan:/dev/ttyACM0`, a LAWICEL adapter at a serial port.
    SlcanSerial(String),
    /// `slcan://host:port`, a LAWICEL adapter behind TCP.
    SlcanTcp(String),
}

/// The text is no address of a bus.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "{0:?} is no bus; there are socketcan:INTERFACE, socketcand://HOST[:PORT]/BUS, slcan:DEVICE and slcan://HOST:PORT"
)]
pub struct AddressError(String);

impl Address {
    /// Whether the adapter has to be told the bit rate.
    #[must_use]
    pub const fn needs_bit_rate(&self) -> bool {
        matches!(self, Address::SlcanSerial(_) | Address::SlcanTcp(_))
    }

    /// A hint for the user whose open bus is lost; `None` where the error has the reason.
    #[must_use]
    pub fn lost_hint(&self) -> Option<String> {
        let behind = match self {
            Address::Socketcand { .. } => "the daemon or the simulator",
            Address::SlcanTcp(_) => "the adapter",
            Address::SocketCan(_) | Address::SlcanSerial(_) => return None,
        };
        Some(format!("the connection to {self} has ended: does {behind} still run?"))
    }

    /// Opens the bus.
    ///
    /// `bit_rate` in kbit/s is for slcan adapters. The bit rate of the other buses is set elsewhere.
    ///
    /// # Errors
    /// [`BusError::Open`].
    pub fn open(&self, bit_rate: u16) -> Result<Box<dyn Bus>, BusError> {
        let bus = match self {
            Address::SocketCan(interface) => open_socketcan(interface),
            Address::Socketcand { host, port, bus } => {
                boxed(Socketcand::connect((host.as_str(), *port), bus))
            }
            Address::SlcanSerial(device) => boxed(Slcan::open_serial(device, bit_rate)),
            Address::SlcanTcp(host) => boxed(Slcan::connect(host, bit_rate)),
        };
        bus.map_err(|reason| BusError::Open { address: self.to_string(), reason })
    }
}

fn boxed(bus: io::Result<impl Bus + 'static>) -> io::Result<Box<dyn Bus>> {
    bus.map(|bus| Box::new(bus) as Box<dyn Bus>)
}

#[cfg(target_os = "linux")]
fn open_socketcan(interface: &str) -> io::Result<Box<dyn Bus>> {
    boxed(super::socketcan::SocketCan::open(interface))
}

#[cfg(not(target_os = "linux"))]
fn open_socketcan(_: &str) -> io::Result<Box<dyn Bus>> {
    Err(io::Error::other("only Linux has SocketCAN"))
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Address, AddressError> {
        parse(text).ok_or_else(|| AddressError(text.to_owned()))
    }
}

fn parse(text: &str) -> Option<Address> {
    let (scheme, rest) = text.split_once(':')?;
    let address = match (scheme, rest.strip_prefix("//")) {
        ("socketcan", None) => Address::SocketCan(rest.to_owned()),
        ("socketcand", Some(rest)) => parse_socketcand(rest)?,
        ("slcan", Some(host)) => Address::SlcanTcp(host.rsplit_once(':').map(|_| host.to_owned())?),
        ("slcan", None) => Address::SlcanSerial(rest.to_owned()),
        _ => return None,
    };
    (!rest.trim_start_matches('/').is_empty()).then_some(address)
}

fn parse_socketcand(rest: &str) -> Option<Address> {
    let (authority, bus) = rest.split_once('/')?;
    let (host, port) = match authority.rsplit_once(':') {
        Some((host, port)) => (host, port.parse().ok()?),
        None => (authority, SOCKETCAND_PORT),
    };
    let is_complete = !host.is_empty() && !bus.is_empty();
    is_complete.then(|| Address::Socketcand { host: host.to_owned(), port, bus: bus.to_owned() })
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Address::SocketCan(interface) => write!(f, "socketcan:{interface}"),
            Address::Socketcand { host, port, bus } => write!(f, "socketcand://{host}:{port}/{bus}"),
            Address::SlcanSerial(device) => write!(f, "slcan:{device}"),
            Address::SlcanTcp(host) => write!(f, "slcan://{host}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_form_is_read_and_written() {
        let daemon = |host: &str, port| Address::Socketcand { host: host.into(), port, bus: "vcan0".into() };
        for (text, address) in [
            ("socketcan:can0", Address::SocketCan("can0".into())),
            ("socketcand://127.0.0.1:29536/vcan0", daemon("127.0.0.1", 29_536)),
            ("slcan:/dev/ttyACM0", Address::SlcanSerial("/dev/ttyACM0".into())),
            ("slcan:COM3", Address::SlcanSerial("COM3".into())),
            ("slcan://localhost:3333", Address::SlcanTcp("localhost:3333".into())),
        ] {
            assert_eq!(text.parse(), Ok(address.clone()), "{text}");
            assert_eq!(address.to_string(), text);
        }
        assert_eq!("socketcand://gateway/vcan0".parse(), Ok(daemon("gateway", 29_536)));
    }

    #[test]
    fn anything_else_is_refused_with_the_forms() {
        for text in [
            "can0",
            "socketcan:",
            "socketcan://can0",
            "socketcand://host:1",
            "socketcand://:1/bus",
            "socketcand://host:x/bus",
            "socketcand://host:1/",
            "slcan:",
            "slcan://host",
            "pcan:1",
        ] {
            let error = text.parse::<Address>().unwrap_err();
            assert!(error.to_string().contains("socketcan:INTERFACE"), "{text}");
        }
    }
}
