//! The first lines: what runs, and what to type to talk to it.

use std::net::SocketAddr;

use crate::cli::Options;
use crate::console;
use crate::gateway::BUS_NAME;

/// Lines for the start of the display, with the addresses that are really served.
pub(crate) fn greeting(options: &Options, socketcand: SocketAddr, slcan: Option<SocketAddr>) -> Vec<String> {
    let nodes: Vec<String> =
        options.nodes.iter().map(|node| format!("{} ({})", node.id, node.personality)).collect();
    let first = options.nodes.first().map_or(1, |node| node.id);
    let (host, port) = (socketcand.ip(), socketcand.port());
    let mut lines = vec![
        format!(
            "node {} at {} kbit/s; socketcand on {socketcand}, bus {BUS_NAME}",
            nodes.join(", "),
            options.bitrate
        ),
        "python: import canopen; network = canopen.Network()".to_owned(),
        format!(
            "        network.connect(interface='socketcand', host='{host}', port={port}, channel='{BUS_NAME}')"
        ),
        format!("        node = network.add_node({first}, canopen.ObjectDictionary())"),
        "        node.sdo.upload(0x1000, 0).hex(); node.nmt.state = 'OPERATIONAL'".to_owned(),
    ];
    lines.push(match &options.socketcan {
        Some(name) => format!("can-utils: candump -ta {name}; cansend {name} 000#01{first:02X}"),
        None => {
            format!("can-utils: socketcandcl -i {BUS_NAME},vcan0 -s {host} -p {port} & candump -ta vcan0")
        }
    });
    lines.extend(slcan.map(|slcan| {
        format!(
            "slcan on {slcan}: can.Bus(interface='slcan', channel='socket://{slcan}', sleep_after_open=0)"
        )
    }));
    lines.push(console::HELP.to_owned());
    lines
}
