//! A scenario for one node, and the deviations that an observer notices: none for a correct node.

use canbus::Time;
use sim::summary::Summary;
use sim::world::World;

use crate::support::{Master, START_ALL, SYNC, frame};

/// The node of the scenario.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Node {
    /// A pressure node at 4 bar.
    Pressure,
    /// A pressure node that also saves its parameters.
    Saving,
    /// A pressure node that saves its parameters while the supply is below what the flash needs.
    LowSupply,
    /// A pressure node; interrupts come between any two instructions, and alignment faults are detected.
    Interleaved,
    /// A pressure node on a chip whose receive FIFOs release a mailbox slowly.
    SlowFifo,
    /// An incremental encoder that turns.
    Encoder,
    /// An absolute encoder at a quarter of its revolution.
    Absolute,
}

/// Steps per revolution of the incremental and of the absolute encoder.
const COUNTS: f64 = 4096.0;
const STEPS: u32 = 8192;
/// Tolerance of the position in counts: the movement during an answer.
const LATENCY: f64 = 60.0;
/// Device type, heartbeat time, kind of the encoder and its position.
const DEVICE_TYPE: (u16, u8) = (0x1000, 0);
const HEARTBEAT: (u16, u8) = (0x1017, 0);
const SENSOR_TYPE: (u16, u8) = (0x2100, 1);
const POSITION: (u16, u8) = (0x6004, 0);
/// 1010h:1.
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
/// A heartbeat time in milliseconds that is not the default.
const PERIOD: u32 = 100;
/// Cycles of PCLK1 that a slow FIFO takes to release a mailbox, 17 us. This is more than a third of the shortest frame
/// at 1 Mbit/s, and less than the tolerance for late samples: a task that waits for the FIFO delays a sample.
const SLOW: u32 = 600;
/// The instant at which the application is running.
const STARTED: Time = Time::from_millis(500);

impl Node {
    /// The flags of the simulator for this node.
    pub(crate) fn flags(self) -> &'static str {
        match self {
            Node::Pressure | Node::Saving | Node::SlowFifo => "--bitrate 1000 --pressure const:400000",
            Node::LowSupply => "--bitrate 1000 --pressure const:400000 --supply const:2.65",
            Node::Interleaved => "--bitrate 1000 --pressure const:400000 --interleave 1",
            Node::Encoder => "--bitrate 1000 --node 1:encoder --shaft rpm:100",
            Node::Absolute => "--bitrate 1000 --node 1:encoder --shaft const:0.25",
        }
    }
}

/// Starts the only node of a world and communicates with it. `before` can seed a bug before the start, `running` while
/// the program runs. Returns the deviations, one line each.
pub(crate) fn observe(
    mut world: World,
    node: Node,
    before: impl FnOnce(&mut World),
    running: impl FnOnce(&mut World),
) -> Vec<String> {
    world.enforce_rules(false);
    let master = Master::join(&mut world);
    let mut said = Vec::new();
    if node == Node::SlowFifo {
        world.machine(0).peripherals_mut().can1_mut().release_after(SLOW);
    }
    before(&mut world);
    world.run_until(STARTED);
    running(&mut world);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    answers(&mut world, &master, node, &mut said);
    flood(&mut world, &master);
    keeps_time(&mut world, &master, &mut said);
    measures(&mut world, &master, node, &mut said);
    told(&world.summary(1.0, 0), &mut said);
    if matches!(node, Node::Saving | Node::LowSupply) {
        saves(&mut world, &master, &mut said);
    }
    if node == Node::LowSupply {
        told(&world.summary(1.0, 0), &mut said);
    }
    said
}

/// The value of an object, if the node answers.
fn read(world: &mut World, master: &Master, (index, sub): (u16, u8)) -> Option<u32> {
    let [low, high] = index.to_le_bytes();
    let answer = ask(world, master, &[0x40, low, high, sub, 0, 0, 0, 0])?;
    (answer[0] & 0xE3 == 0x43).then(|| u32::from_le_bytes([answer[4], answer[5], answer[6], answer[7]]))
}

fn write(world: &mut World, master: &Master, (index, sub): (u16, u8), size: u8, value: u32) -> bool {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    let answer = ask(world, master, &[0x23 | (4 - size) << 2, low, high, sub, a, b, c, d]);
    answer.is_some_and(|answer| answer[0] == 0x60)
}

/// One SDO exchange; `None` when no answer comes within a quarter of a second.
fn ask(world: &mut World, master: &Master, request: &[u8; 8]) -> Option<Vec<u8>> {
    master.heard(world, 0x581);
    master.send(world, 0x601, request);
    (0..250).find_map(|_| {
        world.run_until(world.now() + Time::from_millis(1));
        master.heard(world, 0x581).first().map(|frame| frame.bytes().to_vec())
    })
}

fn answers(world: &mut World, master: &Master, node: Node, said: &mut Vec<String>) {
    if read(world, master, DEVICE_TYPE).is_none() {
        said.push("no answer to SDO".into());
    }
    world.run_until(world.now() + Time::from_millis(5));
    if !master.heard(world, 0x581).is_empty() {
        said.push("more than one answer to SDO".into());
    }
    if node == Node::Absolute && !write(world, master, SENSOR_TYPE, 1, 1) {
        said.push("the encoder cannot be chosen".into());
    }
}

/// Checks half a second of heartbeats.
fn keeps_time(world: &mut World, master: &Master, said: &mut Vec<String>) {
    write(world, master, HEARTBEAT, 2, PERIOD);
    let before = world.summary(1.0, 0).nodes[0].heard.heartbeats;
    world.run_until(world.now() + Time::from_millis(500));
    let heartbeats = world.summary(1.0, 0).nodes[0].heard.heartbeats - before;
    if !(4..=6).contains(&heartbeats) {
        said.push(format!("{heartbeats} heartbeats instead of 5"));
    }
}

/// Thirty frames in a row for FIFO 0, more than a FIFO holds.
fn flood(world: &mut World, master: &Master) {
    let now = world.now();
    (0..30).for_each(|_| world.port(master.port).send(frame(SYNC, &[]), now));
    world.run_until(now + Time::from_millis(100));
}

fn measures(world: &mut World, master: &Master, node: Node, said: &mut Vec<String>) {
    match node {
        Node::Pressure | Node::Saving | Node::LowSupply | Node::Interleaved | Node::SlowFifo => {
            let value = world.summary(1.0, 0).nodes[0].heard.process_value;
            if value.is_none_or(|bar| (bar - 4.0).abs() > 0.02) {
                said.push(format!("the pressure is {value:?} instead of 4.0 bar"));
            }
        }
        Node::Encoder => follows(world, master, said),
        Node::Absolute => {
            let (position, expected) = (read(world, master, POSITION), STEPS / 4);
            if position.is_none_or(|position| position.abs_diff(expected) > 2) {
                said.push(format!("the position is {position:?} instead of {expected}"));
            }
        }
    }
}

/// Checks that the position of the node follows the shaft, over more than a revolution.
fn follows(world: &mut World, master: &Master, said: &mut Vec<String>) {
    let mut look = || {
        let now = world.now();
        let shaft = world.machine(0).peripherals().plant().revolutions(now) * COUNTS;
        let position = read(world, master, POSITION);
        world.run_until(world.now() + Time::from_millis(700));
        position.map(|position| f64::from(position) - shaft)
    };
    let (before, after) = (look(), look());
    if before.zip(after).is_none_or(|(before, after)| (after - before).abs() > LATENCY) {
        said.push(format!("the position is {before:?} beside that of the shaft, then {after:?}"));
    }
}

/// Checks that saved values are present after a power cycle.
fn saves(world: &mut World, master: &Master, said: &mut Vec<String>) {
    let is_saved = ask(world, master, &SAVE).is_some_and(|answer| answer[0] == 0x60);
    if !is_saved {
        said.push("a save is refused".into());
    }
    world.run_until(world.now() + Time::from_millis(200));
    let now = world.now();
    world.machine(0).power_off();
    world.machine(0).power_on(now);
    world.run_until(now + Time::from_millis(900));
    if read(world, master, HEARTBEAT).is_none_or(|value| value & 0xFFFF != PERIOD) {
        said.push("what was saved is lost".into());
    }
}

/// The deviations in the summary of the run.
fn told(summary: &Summary, said: &mut Vec<String>) {
    if summary.bus.errors > 0 {
        said.push(format!("{} errors on the bus", summary.bus.errors));
    }
    let node = &summary.nodes[0];
    said.extend(node.broken_rules.iter().cloned());
    said.extend(node.incidents.iter().cloned());
    said.extend(node.unmodelled.iter().cloned());
    let (heard, sampling) = (&node.heard, &node.sampling);
    if heard.boot_ups != 1 {
        said.push(format!("{} boot-up messages instead of one", heard.boot_ups));
    }
    if let Some(code) = heard.last_emcy.filter(|_| heard.emcys > 0) {
        said.push(format!("EMCY {code:04X}h"));
    }
    if !(999.0..=1001.0).contains(&sampling.rate) {
        said.push(format!("{:.0} samples a second", sampling.rate));
    }
    if sampling.worst_jitter > 20.0 {
        said.push(format!("samples up to {:.0} us late", sampling.worst_jitter));
    }
    if node.receiving.lost > 0 {
        said.push(format!("{} frames lost in a FIFO", node.receiving.lost));
    }
}
