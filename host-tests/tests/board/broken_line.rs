//! Commands of `nodectl` over a line that destroys every frame for a while.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::Time;
use clap::Parser;
use fastrand::Rng;
use host_tests::thorough::either;
use host_tests::watch::expects;
use monitor::Rule;
use nodectl::cli::{Cli, Failure};
use serde_json::Value;
use sim::world::World;

use crate::adapter::{self, Shared};
use crate::support::{SECOND, world};

/// Breaks the line for `length` from `begin` on.
pub(crate) fn noise(begin: Time, length: Time) -> impl FnMut(&mut World) {
    let mut is_on = false;
    move |world| {
        let is_wanted = (begin..begin + length).contains(&world.now());
        if is_wanted && !is_on {
            world.bus().faults.noise(1, 1.0);
        } else if is_on && !is_wanted {
            world.bus().faults.quiet();
        }
        is_on = is_wanted;
    }
}

/// A node, and a client with one command after the other.
struct Desk {
    told: String,
    world: Shared,
    node: u8,
    rng: Rng,
    /// The time of a few requests with their answers, in us.
    few: u64,
}

impl Desk {
    fn new(case: usize) -> Desk {
        let personality = ["pressure", "encoder", "combined", "lift"][case % 4];
        let (node, kbit) = ([1, 16, 127][case % 3], [1000, 250, 125, 50][case / 4 % 4]);
        let told = format!("case {case}, {personality} at {node}, {kbit} kbit/s");
        let world = Rc::new(RefCell::new(world(&format!("--bitrate {kbit} --node {node}:{personality}"))));
        let desk = Desk { told, world, node, rng: Rng::with_seed(case as u64), few: 2_000_000 / kbit };
        desk.pass(SECOND);
        desk
    }

    fn pass(&self, time: Time) {
        let mut world = self.world.borrow_mut();
        let until = world.now() + time;
        world.run_until(until);
    }

    fn run(&self, words: &[&str], happens: impl FnMut(&mut World) + 'static) -> Result<String, Failure> {
        let node = self.node.to_string();
        let line = ["nodectl", "--bus", "socketcan:emulated", "--json", "--node", &node];
        let cli = Cli::try_parse_from(line.iter().chain(words)).unwrap();
        let (printed, result) = adapter::run(&self.world, &cli, happens);
        result.map(|()| printed)
    }

    /// Runs a command. The line breaks within the first frames of the command.
    fn run_over_noise(&mut self, words: &[&str]) -> Result<String, Failure> {
        let begin = self.world.borrow().now() + Time::from_micros(self.rng.u64(..self.few));
        let length = Time::from_millis([20, 300, 1500][self.rng.usize(..3)]);
        let result = self.run(words, noise(begin, length));
        self.world.borrow_mut().bus().faults.quiet();
        // A node in bus-off is back after 3.2 s at most.
        self.pass(SECOND * 4);
        result
    }

    /// Runs a command over noise, and again on a line in order if it fails. Returns whether the first run was answered.
    fn insist(&mut self, words: &[&str]) -> bool {
        let result = self.run_over_noise(words);
        if let Err(failure) = &result {
            println!("{}: {words:?}: {failure}", self.told);
            self.done(words);
        }
        result.is_ok()
    }

    /// Runs a command on a line in order.
    fn done(&self, words: &[&str]) -> String {
        self.run(words, |_| ()).unwrap_or_else(|failure| panic!("{}: {words:?}: {failure}", self.told))
    }

    fn power_cycle(&self) {
        let now = self.world.borrow().now();
        self.world.borrow_mut().machine(0).power_on(now);
        self.pass(SECOND);
    }

    fn heartbeat(&self) -> u64 {
        let object: Value = serde_json::from_str(&self.done(&["read", "1017"])).unwrap();
        object["value"].as_u64().unwrap_or_else(|| panic!("{}: {object}", self.told))
    }
}

#[test]
fn a_value_is_written_and_saved_over_a_line_that_breaks() {
    let _expected = expects([Rule::HeartbeatLate, Rule::SdoSilent]);
    let (mut answered, mut lost) = (0, 0);
    for case in 0..either(12, 100) {
        let mut desk = Desk::new(case);
        let value = 2000 + case as u64;
        lost += usize::from(!desk.insist(&["write", "1017", &value.to_string()]));
        assert_eq!(desk.heartbeat(), value, "{}", desk.told);
        answered += usize::from(desk.insist(&["save"]));
        desk.power_cycle();
        assert_eq!(desk.heartbeat(), value, "{}", desk.told);
    }
    assert!(answered > 0 && lost > 0, "{answered} answered, {lost} lost");
}

#[test]
fn a_node_gets_its_node_id_over_a_line_that_breaks() {
    let _expected = expects([Rule::HeartbeatLate, Rule::SdoSilent]);
    let (mut answered, mut lost) = (0, 0);
    for case in 0..either(12, 100) {
        let mut desk = Desk::new(case);
        let id = 2 + case as u8 % 100;
        let is_answered = desk.insist(&["lss", "set-id", &id.to_string(), "--store"]);
        answered += usize::from(is_answered);
        lost += usize::from(!is_answered);
        desk.power_cycle();
        desk.node = id;
        assert_eq!(desk.heartbeat(), 1000, "{}", desk.told);
    }
    assert!(answered > 0 && lost > 0, "{answered} answered, {lost} lost");
}
