//! The command line of an example that keeps nothing in files.

use std::io;

use canopen::dictionary::Object;
use canopen::eds::DeviceInfo;
use canopen::{Device, NodeId};

use super::socketcand::{Product, run};

/// The command line of an example: `--eds FILE` writes its data sheet, `HOST:PORT BUS NODE` runs it on a bus.
pub(crate) fn main<P: Product>(
    name: &str,
    rows: &[Object],
    make: impl FnOnce(Option<NodeId>) -> (P, Device<P::Definition>),
) -> io::Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match arguments[..] {
        ["--eds", file] => {
            let mut sheet = String::new();
            canopen::eds::write(rows, &DeviceInfo::new("none", name), &mut sheet)
                .map_err(io::Error::other)?;
            std::fs::write(file, sheet)
        }
        [address, bus, node] => {
            let (product, device) = make(node.parse().ok().and_then(NodeId::new));
            run(product, device, address, bus)
        }
        _ => {
            let program = name.to_lowercase();
            Err(io::Error::other(format!("usage: {program} --eds FILE | HOST:PORT BUS NODE")))
        }
    }
}
