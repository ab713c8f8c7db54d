//! `nodectl bus list`: the adapters of this host.

use std::fmt;
use std::fs;
use std::net::{SocketAddr, TcpStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::{Args, Subcommand};
use serde::Serialize;

use super::{Failure, Session};
use crate::text::visible;

/// The folder with the interfaces of Linux; each has a file `type`.
const INTERFACES: &str = "/sys/class/net";
/// The type of a CAN interface (`ARPHRD_CAN`).
const CAN: &str = "280";
/// Where `cargo sim` and socketcand listen.
const SOCKETCAND: ([u8; 4], u16) = ([127, 0, 0, 1], 29_536);
/// How long to wait for a daemon on this host.
const PATIENCE: Duration = Duration::from_millis(200);

/// The buses of this host.
#[derive(Debug, Args)]
pub(super) struct Bus {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Lists CAN interfaces, serial ports that may be slcan adapters, and a socketcand daemon, each as an address for --bus.
    List,
}

#[derive(Serialize)]
struct Found {
    bus: String,
    what: String,
}

impl Bus {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let Command::List = self.command;
        let found: Vec<Found> =
            interfaces(Path::new(INTERFACES)).into_iter().chain(daemon()).chain(serial_ports()).collect();
        if found.is_empty() {
            crate::text::note("no CAN interface, no serial port and no socketcand daemon on this host");
        }
        found.iter().try_for_each(|one| session.print(one))
    }
}

/// The CAN interfaces in a folder of interfaces, with their state.
fn interfaces(folder: &Path) -> Vec<Found> {
    let folder = fs::read_dir(folder).into_iter().flatten().flatten();
    let read = |path: PathBuf| fs::read_to_string(path).unwrap_or_default().trim().to_owned();
    let mut found: Vec<Found> = folder
        .filter(|entry| read(entry.path().join("type")) == CAN)
        .map(|entry| Found {
            bus: format!("socketcan:{}", entry.file_name().to_string_lossy()),
            what: format!("CAN interface, {}", read(entry.path().join("operstate"))),
        })
        .collect();
    found.sort_by(|a, b| a.bus.cmp(&b.bus));
    found
}

fn daemon() -> Option<Found> {
    TcpStream::connect_timeout(&SocketAddr::from(SOCKETCAND), PATIENCE).ok()?;
    let [a, b, c, d] = SOCKETCAND.0;
    let bus = format!("socketcand://{a}.{b}.{c}.{d}:{}/vcan0", SOCKETCAND.1);
    Some(Found { bus, what: "socketcand daemon, or cargo sim".to_owned() })
}

fn serial_ports() -> Vec<Found> {
    let ports = serialport::available_ports().unwrap_or_default();
    ports
        .into_iter()
        .map(|port| {
            let what = match port.port_type {
                serialport::SerialPortType::UsbPort(usb) => {
                    let product = usb.product.unwrap_or_else(|| "no name".to_owned());
                    format!("serial port, USB {:04x}:{:04x}, {product}", usb.vid, usb.pid)
                }
                _ => "serial port".to_owned(),
            };
            Found { bus: format!("slcan:{}", port.port_name), what }
        })
        .collect()
}

impl fmt::Display for Found {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{:<28} {}", visible(&self.bus), visible(&self.what))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_can_interfaces_are_addresses() {
        let folder = std::env::temp_dir().join(format!("nodectl-interfaces-{}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        for (name, kind, state) in [("can1", "280", "up"), ("eth0", "1", "up"), ("can0", "280", "down")] {
            let interface = folder.join(name);
            fs::create_dir_all(&interface).unwrap();
            fs::write(interface.join("type"), format!("{kind}\n")).unwrap();
            fs::write(interface.join("operstate"), format!("{state}\n")).unwrap();
        }
        let lines: Vec<String> = interfaces(&folder).iter().map(ToString::to_string).collect();
        assert_eq!(
            lines,
            [
                "socketcan:can0               CAN interface, down",
                "socketcan:can1               CAN interface, up"
            ]
        );
        fs::remove_dir_all(&folder).unwrap();
        assert!(interfaces(&folder).is_empty());
    }
}
