//! The first lines: what runs, and what to type to talk to it.

use std::net::SocketAddr;

use crate::cli::Options;
use crate::console;
use crate::gateway::BUS_NAME;

/// Lines for the start of the display, with the addresses that are really served.
pub(crate) fn greeting(options: &Options, socketcand: SocketAddr, slcan: Option<SocketAddr>) -> Vec<String> {
    let nodes: Vec<String> =
        options.nodes.iter().map(|node| format!("{} ({})", node.id, node.personality)).collect();
    let mut lines = vec![
        format!(
            "node {} at {} kbit/s; socketcand on {socketcand}, bus {BUS_NAME}",
            nodes.join(", "),
            options.bitrate
        ),
        format!("python: {}", python(socketcand)),
        format!("        node = network.add_node({}, canopen.ObjectDictionary())", options.nodes[0].id),
        "        node.sdo.upload(0x1000, 0).hex(); node.nmt.state = 'OPERATIONAL'".to_owned(),
    ];
    match &options.socketcan {
        Some(interface) => {
            lines.push(format!("can-utils: candump -ta {interface}; cansend {interface} 000#0100"))
        }
        None => lines.push(format!(
            "can-utils: socketcandcl -v -i vcan0 -s {} -p {}; or start with --socketcan vcan0",
            socketcand.ip(),
            socketcand.port()
        )),
    }
    lines.extend(slcan.map(|slcan| {
        format!(
            "slcan on {slcan}: can.Bus(interface='slcan', channel='socket://{slcan}', sleep_after_open=0)"
        )
    }));
    lines.push(console::HELP.to_owned());
    lines
}

fn python(socketcand: SocketAddr) -> String {
    format!(
        "import canopen; network = canopen.Network(); network.connect(interface='socketcand', host='{}', port={}, \
         channel='{BUS_NAME}')",
        socketcand.ip(),
        socketcand.port()
    )
}
