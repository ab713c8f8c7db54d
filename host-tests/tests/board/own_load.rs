//! The load of a node's own process data: with every TPDO due each millisecond, the heartbeat is in time and the SDO
//! server answers, at every bit rate and personality.

use canbus::Time;
use host_tests::thorough::either;
use sim::port::Adapter;
use sim::world::{PortId, World};

use crate::support::{Master, SECOND, START_ALL, frame, world};

const RATES: [u32; 6] = [10, 20, 50, 125, 250, 1000];
const PERSONALITIES: [&str; 4] = ["pressure", "encoder", "combined", "lift"];
/// Producer heartbeat time (1017h) as delivered.
const HEARTBEAT: Time = Time::from_millis(1000);

/// Observations of the master in ten seconds.
struct Seen {
    /// The longest time between two heartbeats.
    heartbeat: Time,
    /// The longest time from an SDO request to its response.
    sdo: Time,
    frames: usize,
}

/// Writes an object; the master waits as long as the slowest bus needs.
fn write(world: &mut World, master: &Master, object: (u16, u8), size: u8, value: u32) -> bool {
    let ([low, high], [a, b, c, d]) = (object.0.to_le_bytes(), value.to_le_bytes());
    let answer = master.ask(world, 1, &[0x23 | (4 - size) << 2, low, high, object.1, a, b, c, d]);
    answer[0] == 0x60
}

/// Gives each TPDO of a measuring personality eight bytes, type 255 and an event timer of 1 ms.
fn map_all(world: &mut World, master: &Master, object: u32) {
    for (number, id) in (0..8_u16).zip([0x181, 0x281, 0x381, 0x481, 0x191, 0x291, 0x391, 0x491]) {
        let (communication, mapping) = (0x1800 + number, 0x1A00 + number);
        write(world, master, (communication, 1), 4, 0xC000_0000 | id);
        for (sub, size, value) in [(0, 1, 0), (1, 4, object), (2, 4, object), (0, 1, 2)] {
            assert!(write(world, master, (mapping, sub), size, value), "{mapping:04X}h:{sub}");
        }
        write(world, master, (communication, 2), 1, 255);
        assert!(write(world, master, (communication, 5), 2, 1));
        assert!(write(world, master, (communication, 1), 4, 0x4000_0000 | id), "{communication:04X}h:1");
    }
}

/// Chooses all units of a lift, each of whose TPDOs has an event timer of 1 ms.
fn choose_all(world: &mut World, master: &Master) {
    assert!(write(world, master, (0x2305, 0), 1, 0x0F));
    for communication in [0x1801, 0x1881, 0x1901, 0x1906, 0x1907, 0x1980, 0x1981] {
        assert!(write(world, master, (communication, 5), 2, 1), "{communication:04X}h:5");
    }
}

/// Other nodes, whose frames are more urgent than all of the node's.
struct Others {
    port: PortId,
    /// Frames in a millisecond.
    rate: f64,
    due: f64,
}

impl Others {
    /// Nodes that take this share of the bus.
    fn join(world: &mut World, kbit: u32, share: f64) -> Others {
        const BITS: f64 = 125.0;
        let port = world.open_port();
        world.port(port).attach(Some(Adapter { bit_rate: kbit * 1000, silent: false }));
        Others { port, rate: share * f64::from(kbit) / BITS, due: 0.0 }
    }

    /// Runs for a millisecond.
    fn run(&mut self, world: &mut World) {
        let now = world.now();
        self.due += self.rate;
        while self.due >= 1.0 {
            world.port(self.port).send(frame(0x010, &[0x55; 8]), now);
            self.due -= 1.0;
        }
        world.run_until(now + Time::from_millis(1));
    }
}

fn loaded(personality: &str, kbit: u32, share: f64) -> Seen {
    let noise = "--pressure sine:250000,200000,7 --shaft ramp:0,60,20";
    let mut world = world(&format!("--bitrate {kbit} --node 1:{personality} {noise}"));
    let master = Master::join_at(&mut world, kbit * 1000);
    world.run_until(SECOND);
    match personality {
        "pressure" => map_all(&mut world, &master, 0x6130_0120),
        "lift" => choose_all(&mut world, &master),
        _ => map_all(&mut world, &master, 0x6004_0020),
    }
    let mut others = Others::join(&mut world, kbit, share);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    for _ in 0..100 {
        others.run(&mut world);
    }
    let begin = world.now();
    world.take_frames();
    let mut sdo = Time::ZERO;
    for second in 0..10 {
        let asked = world.now();
        world.port(master.port).send(frame(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]), asked);
        while master.heard(&mut world, 0x581).is_empty() {
            assert!(world.now().since(asked) < Time::from_millis(5000), "no SDO response in 5 s");
            others.run(&mut world);
        }
        sdo = sdo.max(world.now().since(asked));
        while world.now() < begin + Time::from_millis(1000 * (second + 1)) {
            others.run(&mut world);
        }
    }
    let frames = world.take_frames();
    let of = |id: u16| {
        let id = canbus::StandardId::new(id).unwrap().into();
        frames.iter().filter(move |stamped| stamped.frame.id() == id)
    };
    let beats: Vec<Time> = of(0x701).map(|stamped| stamped.at).collect();
    let ends =
        [begin].into_iter().chain(beats.iter().copied()).zip(beats.iter().copied().chain([world.now()]));
    let heartbeat = ends.map(|(before, after)| after.since(before)).max().unwrap();
    Seen { heartbeat, sdo, frames: frames.len() - of(0x010).count() }
}

/// Checks all cases, and prints a line for each. `most_sdo`: the longest time for an SDO response, in ms.
fn check(cases: &[(&str, u32)], share: f64, most_sdo: u64) {
    println!(
        "| personality | kbit/s | longest time between heartbeats, ms | slowest SDO response, ms | frames a second |"
    );
    for &(personality, kbit) in cases {
        let seen = loaded(personality, kbit, share);
        let [heartbeat, sdo] = [seen.heartbeat, seen.sdo].map(|time| time.as_micros() / 1000);
        println!("| {personality} | {kbit} | {heartbeat} | {sdo} | {} |", seen.frames / 10);
        assert!(seen.heartbeat.as_micros() * 2 <= HEARTBEAT.as_micros() * 3, "{personality}, {kbit} kbit/s");
        assert!(sdo <= most_sdo, "{personality}, {kbit} kbit/s");
    }
}

fn all() -> Vec<(&'static str, u32)> {
    PERSONALITIES.iter().flat_map(|personality| RATES.map(|kbit| (*personality, kbit))).collect()
}

#[test]
fn heartbeat_and_sdo_are_in_time_while_every_tpdo_is_due_each_millisecond() {
    let sample = [("pressure", 10), ("encoder", 50), ("lift", 125), ("lift", 250), ("combined", 1000)];
    check(&either(sample.to_vec(), all()), 0.0, 1000);
}

/// More urgent frames of other nodes take 60 per cent of the bus.
#[test]
fn heartbeat_and_sdo_are_in_time_on_a_bus_that_others_use_too() {
    let sample = [("pressure", 50), ("lift", 10), ("encoder", 1000)];
    check(&either(sample.to_vec(), all()), 0.6, 1500);
}
