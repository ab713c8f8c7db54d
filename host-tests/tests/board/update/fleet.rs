//! `nodectl update` on the bus of the emulated boards, in virtual time.

use std::cell::RefCell;
use std::rc::Rc;

use canbus::{Id, Time};
use canopen::{Duration, Frame, Instant, NodeId};
use chip::Stm32f4;
use emulator::Machine;
use nodectl::Network;
use nodectl::bus::{Bus, BusError, Received};
use nodectl::sdo;
use nodectl::update::{Error, Image, Options, Outcome, Step, Watcher, update};
use sim::world::World;

use super::bench::{VERSION_B, version_a, version_b};
use crate::support::{Master, SECOND, world};

/// Of the adapter: how often it looks for a frame.
const STEP: Time = Time::from_micros(100);

type Shared = Rc<RefCell<World>>;

/// The adapter of `nodectl`.
struct Adapter {
    world: Shared,
    master: Master,
}

impl Adapter {
    fn next(&self) -> Option<Received> {
        let mut world = self.world.borrow_mut();
        let stamped = world.port(self.master.port).receive()?;
        let Id::Standard(id) = stamped.frame.id() else { return None };
        let frame = Frame::new(id.as_raw(), stamped.frame.bytes())?;
        Some(Received { frame, at: instant(stamped.at) })
    }
}

impl Bus for Adapter {
    fn now(&self) -> Instant {
        instant(self.world.borrow().now())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.master.send(&mut self.world.borrow_mut(), frame.id(), frame.data());
        Ok(())
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        loop {
            let received = self.next();
            if received.is_some() || self.now() >= until {
                return Ok(received);
            }
            let mut world = self.world.borrow_mut();
            let next = world.now() + STEP;
            world.run_until(next);
        }
    }
}

fn instant(time: Time) -> Instant {
    Instant(time.as_micros())
}

fn boards(count: u8) -> Shared {
    let nodes: String = (1..=count).map(|node| format!(" --node {node}:pressure")).collect();
    let world = Rc::new(RefCell::new(world(&format!("--bitrate 1000{nodes}"))));
    world.borrow_mut().run_until(SECOND);
    world
}

/// `nodectl update`, forced, as A is the older version.
fn run(
    world: &Shared,
    nodes: &[NodeId],
    image: &sign::image::Image,
    watcher: &mut dyn Watcher,
) -> Vec<Outcome> {
    let master = Master::join(&mut world.borrow_mut());
    let port = master.port;
    let mut adapter = Some(Adapter { world: Rc::clone(world), master });
    let open = move || Ok(Box::new(adapter.take().expect("the bus is opened once")) as Box<dyn Bus>);
    let mut network = Network::open(open).unwrap();
    let image = Image::parse(image.to_bytes()).unwrap();
    let options =
        Options { sdo: sdo::Options::default(), patience: Duration::from_millis(20_000), force: true };
    let results = update(&mut network, nodes, &image, &options, watcher);
    world.borrow_mut().close_port(port);
    let outcome = |(node, result): (NodeId, Result<Outcome, Error>)| {
        result.unwrap_or_else(|error| panic!("node {}: {error}", node.get()))
    };
    results.into_iter().map(outcome).collect()
}

/// Notes the steps, and switches a board off for a while when half of the program has arrived.
struct Switch<'a> {
    world: &'a Shared,
    steps: Vec<(u8, Step)>,
    node: u8,
    off: bool,
    on_at: Time,
}

impl<'a> Switch<'a> {
    fn never(world: &'a Shared) -> Switch<'a> {
        Switch { world, steps: vec![], node: 0, off: false, on_at: Time::ZERO }
    }

    fn machine(&self, act: impl FnOnce(&mut Machine<Stm32f4>, Time)) {
        let mut world = self.world.borrow_mut();
        let now = world.now();
        act(world.machine(usize::from(self.node) - 1), now);
    }
}

impl Watcher for Switch<'_> {
    /// The board is switched on again when another node is served and the time has come.
    fn step(&mut self, node: NodeId, step: Step) {
        println!("{:6.2} s  node {}: {step}", self.world.borrow().now().as_secs_f64(), node.get());
        self.steps.push((node.get(), step));
        if self.off && self.world.borrow().now() >= self.on_at {
            self.off = false;
            self.machine(Machine::power_on);
        }
    }

    fn progress(&mut self, node: NodeId, done: usize, total: usize) {
        if node.get() == self.node && !self.off && done > total / 2 && self.on_at == Time::ZERO {
            self.off = true;
            self.on_at = self.world.borrow().now() + SECOND * 8;
            self.machine(|machine, _| machine.power_off());
        }
    }
}

#[test]
fn nodectl_updates_to_b_and_back() {
    let world = boards(1);
    let nodes = [NodeId::new(1).unwrap()];
    let (a, b) = (version_a(), version_b(0));
    let there = run(&world, &nodes, &b, &mut Switch::never(&world));
    let back = run(&world, &nodes, &a, &mut Switch::never(&world));
    let identifications = [&a, &b].map(|image| Some(image.header.code_crc()));
    assert_eq!([there[0].old_identification, there[0].new_identification], identifications);
    assert_eq!(there[0].new_version, Some(VERSION_B.to_string()));
    assert_eq!([back[0].new_identification, back[0].old_identification], identifications);
    assert_eq!(back[0].new_version.as_deref(), Some(env!("CARGO_PKG_VERSION")));
}

#[test]
fn four_nodes_of_which_one_is_switched_off_halfway_and_gone_on_with() {
    let world = boards(4);
    let nodes: Vec<NodeId> = (1..=4).filter_map(NodeId::new).collect();
    let b = version_b(0);
    let mut switch = Switch { node: 2, ..Switch::never(&world) };
    let outcomes = run(&world, &nodes, &b, &mut switch);
    assert_eq!(outcomes.len(), 4);
    for outcome in outcomes {
        assert_eq!(outcome.new_identification, Some(b.header.code_crc()));
        assert_eq!(outcome.old_identification, Some(version_a().header.code_crc()));
    }
    let lost = |of: u8| switch.steps.iter().filter(|step| **step == (of, Step::Lost)).count();
    assert_eq!([1, 2, 3, 4].map(lost), [0, 1, 0, 0]);
    assert_eq!(switch.steps.last(), Some(&(2, Step::Start)), "it gets its turn after the others");
}
