//! The matrix in process: the library and the node on a simulated bus.

use canopen::{Duration, Frame, NodeId};
use host_tests::bench::{raw, setup};
use host_tests::matrix::{Case, each};
use host_tests::network::Network;
use host_tests::station::Station;
use node::{BitRate, Setup};
use profiles::board::RawSample;

use crate::bus::{Bus, Node};
use crate::services;

/// A bus with one node.
struct Process {
    network: Network<Station<RawSample>>,
    kbit: u16,
}

impl Process {
    fn of(case: Case) -> Process {
        let Case { personality, node_id, kbit } = case;
        let bit_rate = BitRate::from_kbit(kbit).expect("a bit rate");
        let setup = Setup { personality, node_id: NodeId::new(node_id), bit_rate, ..setup() };
        let mut network = Network::at(kbit, [Station::new(&setup, raw(100_000.0, 298.15))]);
        network.start();
        network.run(Duration::from_millis(200));
        Process { network, kbit }
    }
}

impl Bus for Process {
    fn run(&mut self, span: Duration) {
        self.network.run(span);
    }

    fn send(&mut self, id: u16, data: &[u8]) {
        self.network.transmit(&Frame::new(id, data).expect("a frame"));
    }

    fn hear(&mut self, id: u16) -> Option<Frame> {
        self.network.hear_id(id)
    }

    fn kbit(&self) -> u16 {
        self.kbit
    }
}

/// Runs a test in its cases.
fn in_process(name: &str, run: fn(&mut Node<'_, Process>, Case)) {
    each(&format!("{name} in process"), |case| {
        let mut bus = Process::of(case);
        run(&mut Node { bus: &mut bus, id: case.node_id }, case);
    });
}

#[test]
fn save_and_restore() {
    in_process("save and restore", |node, _| services::save_and_restore(node));
}

#[test]
fn a_node_id_by_lss() {
    in_process("node-ID by LSS", |node, _| services::a_node_id_by_lss(node));
}

#[test]
fn states() {
    in_process("NMT", |node, _| services::states(node));
}

#[test]
fn heartbeats() {
    in_process("heartbeat", |node, _| services::heartbeats(node));
}

#[test]
fn an_error() {
    in_process("EMCY", |node, _| services::an_error(node));
}

#[test]
fn a_remapped_tpdo() {
    in_process("PDO mapping", services::a_remapped_tpdo);
}
