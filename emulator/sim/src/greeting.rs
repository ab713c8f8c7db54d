//! The first lines: the running boards and the served addresses, with the commands to connect.

use std::net::SocketAddr;

use serde_json::{Value, json};

use crate::board::{Board, Programs};
use crate::cli::Options;
use crate::console;
use crate::gateway::BUS_NAME;

/// The highest node-ID of CiA 301.
const LAST_NODE_ID: u8 = 127;

/// The line of the example where no board has a node-ID.
const FIND: &str = "        network.lss.fast_scan()";

/// The lines of the example that use a node.
fn example(node: u8) -> Vec<String> {
    vec![
        format!("        node = network.add_node({node}, canopen.ObjectDictionary())"),
        "        node.sdo.upload(0x1000, 0).hex(); node.nmt.state = 'OPERATIONAL'".to_owned(),
    ]
}

/// The content of the greeting, with the addresses that are actually served.
pub(crate) struct Greeting<'a> {
    pub(crate) options: &'a Options,
    pub(crate) socketcand: SocketAddr,
    pub(crate) slcan: Option<SocketAddr>,
    pub(crate) control: Option<SocketAddr>,
    /// The address of the page, or the reason for its absence; `None` when no page was requested.
    pub(crate) page: Option<Result<&'a str, &'a str>>,
    pub(crate) boards: &'a [Board],
}

impl Greeting<'_> {
    /// Lines for the start of the display.
    pub(crate) fn lines(&self) -> Vec<String> {
        let Greeting { options, socketcand, slcan, control, page, boards } = *self;
        let nodes: Vec<String> =
            options.nodes.iter().map(|node| format!("{} ({})", node.id, node.personality)).collect();
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
        ];
        // Boards without a node-ID wait for LSS.
        let first = options.nodes.iter().map(|node| node.id).find(|id| *id <= LAST_NODE_ID);
        lines.extend(first.map_or_else(|| vec![FIND.to_owned()], example));
        lines.push(match &options.socketcan {
            Some(name) => {
                format!("can-utils: candump -ta {name}; cansend {name} 000#01{:02X}", first.unwrap_or(0))
            }
            None => {
                format!("can-utils: socketcandcl -i {BUS_NAME},vcan0 -s {host} -p {port} & candump -ta vcan0")
            }
        });
        lines.extend(slcan.map(|slcan| {
            format!(
                "slcan on {slcan}: can.Bus(interface='slcan', channel='socket://{slcan}', sleep_after_open=0)"
            )
        }));
        match page {
            Some(Ok(address)) => lines.insert(1, format!("page: {address}")),
            Some(Err(reason)) => lines.insert(1, format!("no page: {reason}")),
            None => {}
        }
        lines.extend(
            control.filter(|_| options.control.is_some()).map(|control| format!("control on {control}")),
        );
        if options.flash.is_some() {
            lines.extend(boards.iter().map(programs));
        }
        lines.push(console::help(&[]));
        lines
    }

    /// One line of JSON for programs.
    pub(crate) fn json(&self) -> Value {
        let boards =
            self.boards.iter().map(|board| json!({ "id": board.id(), "programs": name(board.programs()) }));
        json!({
            "socketcand": self.socketcand, "slcan": self.slcan, "control": self.control,
            "page": self.page.and_then(Result::ok), "bus": BUS_NAME, "boards": boards.collect::<Vec<_>>(),
        })
    }
}

/// The programs in the board's flash: written now, or kept.
fn programs(board: &Board) -> String {
    let what = match board.programs() {
        Programs::Written => "firmware and bootloader are written into its flash",
        Programs::Kept => "its flash is kept, with this firmware and bootloader",
        Programs::Others => {
            "its flash is kept, with other programs, whose log cannot be read; --reflash writes these"
        }
    };
    format!("node {}: {what}", board.id())
}

fn name(programs: Programs) -> &'static str {
    match programs {
        Programs::Written => "written",
        Programs::Kept => "kept",
        Programs::Others => "others kept",
    }
}
