//! The response-time analysis of the tasks: the worst measured execution time of each task on the emulated board, and
//! its latest end.
//!
//! A task of priority p ends at the latest after R = B + C + sum over the tasks of higher priority of ceil(R / T) C,
//! where C is the worst execution time and T the least time between two activations of each task (Audsley and others,
//! 1993). Frames that wait in mailboxes let some activations come early; they are added. C is the worst time measured in
//! a busy run, with the cycles counted at worst. B is the delay by tasks of lower priority: a word that the flash
//! programs, at the longest time of the data sheet, and the longest time in that run from the request to the first instruction
//! in which no task of the same or a higher priority ran. The latter contains the locks of RTIC.
//!
//! The interrupt controller keeps one request of each task. A task that is requested while it runs therefore runs once more:
//! where R is longer than T, it contains C twice.
//!
//! A run takes all frames that wait. For the task that sends and the task of the process data, C is therefore not the worst run
//! but that of one frame: the worst run while nothing is saved, and while only RPDOs come. The worst run is counted once more;
//! for the task of the process data once each millisecond, the shortest period of a SYNC.
//!
//! An activation begins when its request is set, also if its task runs at this time, and ends when the run that serves the
//! request ends. No measured end may be later than the computed one.

use canbus::Time;
use emulator::{Activity, Estimate, Exception};
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, SYNC, world};

/// HCLK in cycles per microsecond.
const CYCLES: f64 = 144.0;
/// The core stops while the flash programs a word: the longest time in table 49 of the data sheet, in us.
const FLASH: f64 = 100.0;
/// The shortest frame, and the shortest frame of eight bytes, at 1 Mbit/s with the intermission, in us.
const SHORTEST_FRAME: f64 = 47.0;
const FULL_FRAME: f64 = 111.0;
/// The shortest frame that the node sends, the heartbeat: one byte.
const SHORTEST_SENT: f64 = 55.0;
/// 1010h:1, save all parameters.
const SAVE: [u8; 8] = [0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'];
/// RPDOs in a millisecond, with room between them for other frames.
const RPDOS: usize = 6;
/// Duration of each part of the busy run, in ms.
const PART: u64 = 1500;

/// The known properties of a task.
struct Task {
    name: &'static str,
    priority: u8,
    irqs: &'static [u8],
    /// Least time between two activations, in us, apart from `burst` activations that come before their time.
    period: f64,
    burst: f64,
    /// Whether two activations in a row belong together.
    is_pair: bool,
    /// Latest end after the activation, in us.
    deadline: f64,
    /// The reason for the deadline.
    reason: &'static str,
}

/// The tasks of the firmware, the most urgent first (docs/architecture.md).
const TASKS: [Task; 6] = [
    Task {
        name: "receive",
        priority: 6,
        irqs: &[20, 21],
        period: SHORTEST_FRAME,
        burst: 0.0,
        is_pair: false,
        deadline: 3.0 * SHORTEST_FRAME,
        reason: "the FIFO holds three frames",
    },
    Task {
        name: "sample",
        priority: 5,
        irqs: &[56],
        period: 1000.0,
        burst: 0.0,
        is_pair: false,
        deadline: 1000.0,
        reason: "the DMA controller fills the other half",
    },
    Task {
        name: "transmit",
        priority: 4,
        irqs: &[19],
        // For each frame one activation that moves it, and one that finds the mailboxes full. The mailboxes hold two
        // frames beside the one that is sent.
        period: SHORTEST_SENT,
        burst: 2.0,
        is_pair: true,
        deadline: 1000.0,
        reason: "three frames wait in the mailboxes meanwhile",
    },
    Task {
        name: "process",
        priority: 3,
        irqs: &[28],
        period: FULL_FRAME,
        burst: 0.0,
        is_pair: false,
        deadline: 1000.0,
        reason: "a PDO is at most a millisecond late",
    },
    Task {
        name: "serve",
        priority: 2,
        irqs: &[22],
        period: 1000.0,
        burst: 0.0,
        is_pair: false,
        deadline: 20_000.0,
        reason: "a client waits for its answer",
    },
    Task {
        name: "store",
        priority: 1,
        irqs: &[49],
        period: 1_000_000.0,
        burst: 0.0,
        is_pair: false,
        deadline: 1_000_000.0,
        reason: "the client of a save waits a second",
    },
];

/// The measured properties of a task, in us and instructions.
struct Measured {
    entries: u64,
    instructions: u64,
    worst: f64,
    /// The worst run that takes one frame.
    frame: f64,
    latency: f64,
    blocking: f64,
    response: f64,
}

impl Measured {
    /// The larger of both.
    fn max(&self, other: &Measured) -> Measured {
        Measured {
            entries: self.entries.max(other.entries),
            instructions: self.instructions.max(other.instructions),
            worst: self.worst.max(other.worst),
            frame: self.frame,
            latency: self.latency.max(other.latency),
            blocking: self.blocking.max(other.blocking),
            response: self.response.max(other.response),
        }
    }
}

/// The times of the tasks since the last call.
fn measure(world: &mut World) -> [Measured; TASKS.len()] {
    let stats = world.machine(0).stats();
    let measured = TASKS.map(|task| {
        let all = || task.irqs.iter().map(|&irq| stats.of(Exception::irq(irq)));
        let longest = |times: fn(&Activity) -> Time| {
            all().map(|activity| times(activity).as_secs_f64() * 1e6).fold(0.0, f64::max)
        };
        let most =
            |activity: &Activity| if task.is_pair { activity.worst_pair } else { activity.worst_cycles };
        let worst = all().map(most).max().unwrap_or(0) as f64 / CYCLES;
        Measured {
            entries: all().map(|activity| activity.entries).sum(),
            instructions: all().map(|activity| activity.worst_instructions).max().unwrap_or(0),
            worst,
            frame: worst,
            latency: longest(|activity| activity.worst_latency),
            blocking: longest(|activity| activity.worst_blocking),
            response: longest(|activity| activity.worst_response),
        }
    });
    world.machine(0).forget_worst();
    measured
}

/// The places of the tasks.
const RECEIVE: usize = 0;
const SAMPLE: usize = 1;
const TRANSMIT: usize = 2;
const PROCESS: usize = 3;

/// The longest time that more urgent tasks take of a span, in us.
///
/// A frame on the bus is sent or received by the node, not both. Up to the task that sends, all frames count for each task.
/// For the task of the process data, all count as sent, which takes longer than to receive one. For the tasks after it, the
/// bus is full of the frames that take the longest for their length: sent ones, or process data that is received. Each
/// millisecond, a SYNC and a sample wake the task of the process data as well.
fn preempted(tasks: &[(Task, Measured)], place: usize, span: f64) -> f64 {
    let worst = |at: usize| tasks[at].1.worst;
    let frame = |at: usize| tasks[at].1.frame;
    let several = |at: usize| worst(at) - frame(at);
    let of = |at: usize| ((span / tasks[at].0.period).ceil() + tasks[at].0.burst) * frame(at) + several(at);
    match place {
        ..=TRANSMIT => (0..place).map(of).sum(),
        PROCESS => of(SAMPLE) + of(TRANSMIT),
        _ => {
            let received = worst(RECEIVE) + frame(PROCESS);
            let frames = of(TRANSMIT).max((span / FULL_FRAME).ceil() * received);
            // One frame of the other kind, of which a part is in the span, and those that wait in mailboxes.
            let parts = received + tasks[TRANSMIT].0.burst * frame(TRANSMIT) + several(TRANSMIT);
            let woken = (span / tasks[SAMPLE].0.period).ceil() * worst(PROCESS);
            frames + parts + woken + of(SAMPLE) + (PROCESS + 1..place).map(of).sum::<f64>()
        }
    }
}

/// R of the task at this place, or `None` when R exceeds the deadline.
fn response(tasks: &[(Task, Measured)], place: usize) -> Option<f64> {
    let (task, own) = &tasks[place];
    let blocking = FLASH + own.blocking;
    let mut response = blocking + own.worst;
    loop {
        // A request that comes while the task runs waits for the end of this run. Further ones are one with it.
        let runs = if response > task.period { 2.0 } else { 1.0 };
        let next = blocking + runs * own.worst + preempted(tasks, place, response);
        if next > task.deadline {
            return None;
        }
        if next <= response {
            return Some(response);
        }
        response = next;
    }
}

/// A node that sends its TPDOs with every SYNC, on a bus that other nodes fill.
fn busy_node(estimate: Estimate) -> (World, Master) {
    let mut world = world(&format!("--node 1:combined --bitrate 1000 --load 100 --cycles {estimate}"));
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    for tpdo in 0..4 {
        master.ask(&mut world, 1, &[0x2F, tpdo, 0x18, 2, 1, 0, 0, 0]);
    }
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + SECOND);
    world.machine(0).forget_worst();
    (world, master)
}

/// The highest load that the bus can carry: every TPDO with every SYNC, RPDOs, SDO transfers, and
/// foreign frames.
fn load(world: &mut World, master: &Master, milliseconds: u64) {
    for millisecond in 0..milliseconds {
        master.send(world, SYNC, &[]);
        master.send(world, 0x201, &[millisecond as u8; 8]);
        let long = millisecond % 4 == 0;
        let upload = if long {
            [0x40, 0x08, 0x10, 0, 0, 0, 0, 0]
        } else {
            [0x60 | ((millisecond as u8 & 1) << 4), 0, 0, 0, 0, 0, 0, 0]
        };
        master.send(world, 0x601, &upload);
        world.run_until(world.now() + Time::from_millis(1));
    }
}

/// RPDOs alone.
fn rpdos(world: &mut World, master: &Master, milliseconds: u64) {
    for millisecond in 0..milliseconds {
        for _ in 0..RPDOS {
            master.send(world, 0x201, &[millisecond as u8; 8]);
        }
        world.run_until(world.now() + Time::from_millis(1));
    }
}

/// A bus full of RPDOs, and then the other load without and with a save. `after` sees the node after each of the three.
pub(crate) fn busy_run(estimate: Estimate, mut after: impl FnMut(&mut World)) -> World {
    let (mut world, master) = busy_node(estimate);
    rpdos(&mut world, &master, PART);
    after(&mut world);
    load(&mut world, &master, PART);
    after(&mut world);
    master.send(&mut world, 0x601, &SAVE);
    load(&mut world, &master, PART);
    after(&mut world);
    world
}

/// The times of the tasks in a busy run.
fn measured(estimate: Estimate) -> [Measured; TASKS.len()] {
    let mut parts = Vec::new();
    busy_run(estimate, |world| parts.push(measure(world)));
    core::array::from_fn(|place| {
        let [rpdos, load, save] = [0, 1, 2].map(|part: usize| &parts[part][place]);
        let all = rpdos.max(load).max(save);
        let frame = match place {
            TRANSMIT => load.worst,
            PROCESS => rpdos.worst,
            _ => all.worst,
        };
        Measured { frame, ..all }
    })
}

#[test]
fn every_task_ends_before_its_deadline() {
    let [best, modelled, worst] = [Estimate::Best, Estimate::Modelled, Estimate::Worst].map(measured);
    println!(
        "| task | priority | most instructions | us of them, best, modelled and worst | begins late, us; of this blocked | ends, us | period, us | response, us | deadline, us | why |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let tasks: Vec<(Task, Measured)> = TASKS.into_iter().zip(worst).collect();
    for (place, (task, own)) in tasks.iter().enumerate() {
        println!(
            "| {} | {} | {} | {:.1}, {:.1}, {:.1} | {:.1}, {:.1} | {:.1} | {:.0} | {} | {:.0} | {} |",
            task.name,
            task.priority,
            modelled[place].instructions,
            best[place].worst,
            modelled[place].worst,
            own.worst,
            own.latency,
            own.blocking,
            own.response,
            task.period,
            response(&tasks, place).map_or("late".into(), |response| format!("{response:.1}")),
            task.deadline,
            task.reason
        );
        assert!(own.entries > 0, "{} has hardly run", task.name);
        assert!(
            response(&tasks, place).is_none_or(|computed| own.response <= computed),
            "{} ended {:.1} us after its request, later than the analysis allows",
            task.name,
            own.response
        );
    }
    assert!(tasks[TRANSMIT].1.worst > tasks[0].1.worst, "to receive a frame takes longer than to send one");
    assert!((0..tasks.len()).all(|place| response(&tasks, place).is_some()), "a task can be late");
}
