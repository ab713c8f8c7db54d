//! The matrix on the emulated board: the images that are flashed.

use canbus::Time;
use canopen::{Duration, Frame};
use host_tests::matrix::{Case, each};
use host_tests::network::from_bus;
use sim::world::World;

use crate::bus::{Bus, Node};
use crate::services;
use crate::support::{Master, SECOND, world};

/// A bus with one board.
struct Board {
    world: World,
    master: Master,
    heard: Vec<Frame>,
    kbit: u16,
}

impl Board {
    fn of(case: Case) -> Board {
        let Case { personality, node_id, kbit } = case;
        let name = personality.file_name().trim_end_matches(".eds");
        let mut world = world(&format!("--node {node_id}:{name} --bitrate {kbit}"));
        let master = Master::join_at(&mut world, u32::from(kbit) * 1000);
        world.run_until(SECOND);
        Board { world, master, heard: Vec::new(), kbit }
    }
}

impl Bus for Board {
    fn run(&mut self, span: Duration) {
        self.world.run_until(self.world.now() + Time::from_micros(span.0));
    }

    fn send(&mut self, id: u16, data: &[u8]) {
        self.master.send(&mut self.world, id, data);
        // The longest frame at this bit rate.
        self.run(Duration(140_000 / u64::from(self.kbit)));
    }

    fn hear(&mut self, id: u16) -> Option<Frame> {
        let port = self.world.port(self.master.port);
        self.heard
            .extend(std::iter::from_fn(|| port.receive()).filter_map(|stamped| from_bus(&stamped.frame)));
        let place = self.heard.iter().position(|frame| frame.id() == id)?;
        Some(self.heard.remove(place))
    }

    fn kbit(&self) -> u16 {
        self.kbit
    }
}

/// Runs a test in its cases.
fn on_the_board(name: &str, run: fn(&mut Node<'_, Board>, Case)) {
    each(&format!("{name} on the board"), |case| {
        let mut bus = Board::of(case);
        run(&mut Node { bus: &mut bus, id: case.node_id }, case);
    });
}

#[test]
fn save_and_restore_on_the_board() {
    on_the_board("save and restore", |node, _| services::save_and_restore(node));
}

#[test]
fn a_node_id_by_lss_on_the_board() {
    on_the_board("node-ID by LSS", |node, _| services::a_node_id_by_lss(node));
}

#[test]
fn states_on_the_board() {
    on_the_board("NMT", |node, _| services::states(node));
}

#[test]
fn heartbeats_on_the_board() {
    on_the_board("heartbeat", |node, _| services::heartbeats(node));
}

#[test]
fn an_error_on_the_board() {
    on_the_board("EMCY", |node, _| services::an_error(node));
}

#[test]
fn a_remapped_tpdo_on_the_board() {
    on_the_board("PDO mapping", services::a_remapped_tpdo);
}
