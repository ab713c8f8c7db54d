//! Room in the parameter memory, on the board: a page is erased while the node runs, in Pre-operational. The erase stops
//! the core for 0.25 s. Heartbeats, SDO responses and positions stay right.

use canbus::{Id, Stamped, Time};
use host_tests::thorough;
use sim::world::World;

use crate::support::{Master, SECOND, START_ALL, frame, read, run, world, write};

const PERSONALITIES: [&str; 4] = ["pressure", "encoder", "combined", "lift"];
const SAVE: u32 = u32::from_le_bytes(*b"save");
/// 1010h:1, and a value of each group: the event timer of a heartbeat consumer without a node, and 2002h:3.
const ALL: (u16, u8) = (0x1010, 1);
const COMMUNICATION: (u16, u8) = (0x1016, 1);
const APPLICATION: (u16, u8) = (0x2002, 3);
const HEARTBEAT: (u16, u8) = (0x1017, 0);
const LOST_MILLISECONDS: (u16, u8) = (0x2001, 2);
const LOST_FRAMES: (u16, u8) = (0x2001, 1);
const SAVES_LEFT: (u16, u8) = (0x2010, 1);
pub(crate) const ERASES: (u16, u8) = (0x2010, 2);
const PRESET: (u16, u8) = (0x6003, 0);
const POSITION: (u16, u8) = (0x6004, 0);
const SENSOR_STATE: (u16, u8) = (0x210B, 1);
const DEVICE_STATE: u32 = 0x0800_0022;
pub(crate) const PRE_OPERATIONAL: [u8; 2] = [0x80, 1];
/// The longest erase of a page, and what the save adds.
const LONGEST_ANSWER: Time = Time::from_millis(600);

/// Writes with the response within `span`: the abort code, and the time of the answer.
fn store(world: &mut World, master: &Master, (index, sub): (u16, u8), value: u32) -> (Result<(), u32>, Time) {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    master.heard(world, 0x581);
    let start = world.now();
    master.send(world, 0x601, &[0x23, low, high, sub, a, b, c, d]);
    while world.now() < start + SECOND {
        world.run_until(world.now() + Time::from_micros(200));
        if let Some(frame) = master.heard(world, 0x581).first() {
            let [command, .., a, b, c, d] = *frame.bytes() else { panic!("eight bytes") };
            let result = if command == 0x60 { Ok(()) } else { Err(u32::from_le_bytes([a, b, c, d])) };
            return (result, world.now().since(start));
        }
    }
    panic!("no answer of {index:x}h within a second");
}

/// The longest time between two heartbeats.
fn longest_gap(frames: &[Stamped]) -> Time {
    let id = frame(0x701, &[]).id();
    let times: Vec<Time> = frames.iter().filter(|sent| sent.frame.id() == id).map(|sent| sent.at).collect();
    times.windows(2).map(|pair| pair[1].since(pair[0])).max().expect("two heartbeats")
}

fn emcys(frames: &[Stamped]) -> Vec<u16> {
    let id: Id = frame(0x081, &[]).id();
    let emcys = frames.iter().filter(|sent| sent.frame.id() == id);
    emcys.map(|sent| u16::from_le_bytes([sent.frame.bytes()[0], sent.frame.bytes()[1]])).collect()
}

fn started(personality: &str, bit_rate: u32) -> (World, Master) {
    let mut world = world(&format!("--node 1:{personality} --bitrate {bit_rate} --pressure const:250000"));
    let master = Master::join_at(&mut world, bit_rate * 1000);
    world.run_until(SECOND);
    world.take_frames();
    (world, master)
}

/// A change and a save of all groups.
pub(crate) fn save_change(world: &mut World, master: &Master, number: u32) -> (Result<(), u32>, Time) {
    write(world, master, COMMUNICATION, 4, number);
    write(world, master, APPLICATION, 2, number);
    store(world, master, ALL, SAVE)
}

#[test]
fn saves_in_pre_operational_never_fill_the_memory_and_delay_no_heartbeat_and_no_answer() {
    let bit_rates: &[u32] = thorough::either(&[250], &[1000, 250, 50, 10]);
    for (personality, &bit_rate) in
        PERSONALITIES.iter().flat_map(|one| bit_rates.iter().map(move |rate| (one, rate)))
    {
        let (mut world, master) = started(personality, bit_rate);
        write(&mut world, &master, HEARTBEAT, 2, 1000);
        let mut times = vec![];
        for number in 1..=thorough::either(40, 120) {
            let (result, time) = save_change(&mut world, &master, number);
            assert_eq!(result, Ok(()), "{personality}, save {number}");
            times.push(time);
            world.run_until(world.now() + Time::from_millis(u64::from(number % 7) * 13));
        }
        let frames = world.take_frames();
        let gap = longest_gap(&frames);
        let erases = read(&mut world, &master, ERASES);
        times.sort_unstable();
        println!(
            "{personality} at {bit_rate} kbit/s: {erases} erases in {} saves, answer after {} us, {} us at most; \
             heartbeats {} ms apart at most; {} lost milliseconds, {} lost frames, EMCYs {:x?}",
            times.len(),
            times[times.len() / 2].as_micros(),
            times[times.len() - 1].as_micros(),
            gap.as_micros() / 1000,
            read(&mut world, &master, LOST_MILLISECONDS),
            read(&mut world, &master, LOST_FRAMES),
            emcys(&frames),
        );
        assert!(erases >= 2, "{personality}: {erases}");
        assert!(times[times.len() - 1] <= LONGEST_ANSWER);
        assert!(gap <= Time::from_millis(1500), "{personality}: {gap:?}");
        assert_eq!(emcys(&frames), [0_u16; 0], "{personality}");
        let summary = run(&mut world, Time::from_millis(1));
        assert!(summary.nodes[0].incidents.is_empty(), "{summary}");
        // After a reset: the last save.
        let number = thorough::either(40, 120);
        master.send(&mut world, 0, &[0x81, 1]);
        world.run_until(world.now() + SECOND);
        assert_eq!(read(&mut world, &master, APPLICATION), number, "{personality}");
        assert_eq!(read(&mut world, &master, COMMUNICATION), number, "{personality}");
    }
}

#[test]
fn an_operational_node_refuses_without_effect_and_loses_no_sample_and_pre_operational_makes_room() {
    for personality in PERSONALITIES {
        let (mut world, master) = started(personality, 250);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        world.run_until(world.now() + Time::from_millis(100));
        for round in 0..2 {
            let mut saves = 0;
            let left = read(&mut world, &master, SAVES_LEFT);
            while read(&mut world, &master, SAVES_LEFT) > 0 {
                saves += 1;
                assert_eq!(save_change(&mut world, &master, 1000 * round + saves).0, Ok(()), "{personality}");
            }
            println!(
                "{personality}: {left} saves left by 2010h:1, {saves} saves of all groups in Operational"
            );
            assert!(left >= 2 && saves >= left, "{personality}: {saves}");
            assert_eq!(save_change(&mut world, &master, 77).0, Err(DEVICE_STATE), "{personality}");
            let erases = read(&mut world, &master, ERASES);
            if round == 0 {
                assert_eq!(read(&mut world, &master, LOST_MILLISECONDS), 0, "{personality}");
            }
            master.send(&mut world, 0, &PRE_OPERATIONAL);
            world.run_until(world.now() + Time::from_millis(700));
            assert!(read(&mut world, &master, SAVES_LEFT) > 0, "{personality}");
            assert_eq!(read(&mut world, &master, ERASES), erases, "the next move counts");
            master.send(&mut world, START_ALL.0, &START_ALL.1);
        }
        let summary = run(&mut world, Time::from_millis(1));
        assert!(summary.nodes[0].incidents.is_empty(), "{summary}");
    }
}

/// From the preset on that finds no room, the position stays as the last accepted preset has made it, also after a loss of
/// power.
#[test]
fn a_preset_that_is_refused_does_not_move_the_position() {
    let (mut world, master) = started("encoder", 1000);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(world.now() + Time::from_millis(100));
    let mut last = 0;
    loop {
        let (result, _) = store(&mut world, &master, PRESET, last + 1000);
        if result.is_err() {
            break;
        }
        last += 1000;
    }
    println!("{} presets in Operational", last / 1000);
    assert!(last >= 30_000, "{last}");
    world.run_until(world.now() + Time::from_millis(20));
    assert_eq!(read(&mut world, &master, POSITION), last);
    let now = world.now();
    world.machine(0).power_off();
    world.machine(0).power_on(now);
    world.run_until(now + SECOND);
    assert_eq!(read(&mut world, &master, POSITION), last);
    assert_eq!(store(&mut world, &master, PRESET, 5).0, Ok(()), "the start has made room");
}

/// Nothing counts turns during an erase.
#[test]
fn no_page_is_erased_while_the_shaft_turns() {
    let mut world = world("--node 1:encoder --bitrate 1000 --shaft ramp:0,20,20");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    let mut number = 0;
    while read(&mut world, &master, SAVES_LEFT) > 0 {
        number += 1;
        assert_eq!(save_change(&mut world, &master, number).0, Ok(()));
    }
    world.run_until(SECOND * 15);
    assert_eq!(read(&mut world, &master, SAVES_LEFT), 0, "it turns");
    assert_eq!(read(&mut world, &master, LOST_MILLISECONDS), 0);
    world.run_until(SECOND * 23);
    assert!(read(&mut world, &master, SAVES_LEFT) > 0, "at rest");
}

/// An SDO request to a node, with its answer within a second.
fn asked(
    world: &mut World,
    master: &Master,
    node: u8,
    (index, sub): (u16, u8),
    command: u8,
    value: u32,
) -> [u8; 8] {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    let answers = 0x580 + u16::from(node);
    master.heard(world, answers);
    let start = world.now();
    master.send(world, 0x600 + u16::from(node), &[command, low, high, sub, a, b, c, d]);
    while world.now() < start + SECOND {
        world.run_until(world.now() + Time::from_micros(200));
        if let Some(answer) = master.heard(world, answers).first() {
            assert_ne!(answer.bytes()[0], 0x80, "{index:x}h of node {node}: {answer:x?}");
            return answer.bytes().try_into().expect("eight bytes");
        }
    }
    panic!("no answer of {index:x}h within a second");
}

/// After an erase, which may end at any phase of a sample, the next sample may follow at once: the word of an SSI sensor
/// is then still on the line.
#[test]
fn an_erase_that_ends_at_any_phase_of_a_sample_is_no_fault_of_the_sensor() {
    const PHASES: u64 = 36;
    let nodes = [("encoder", 1, 1000), ("combined", 77, 500), ("lift", 127, 250)];
    // The budget allows 20 erases.
    for ((personality, node, bit_rate), first) in nodes.iter().flat_map(|node| [(*node, 0), (*node, 1)]) {
        let flags = format!("--node {node}:{personality} --bitrate {bit_rate} --shaft const:3.3");
        let mut world = world(&flags);
        let master = Master::join_at(&mut world, bit_rate * 1000);
        world.run_until(SECOND);
        let erases = |world: &mut World| asked(world, &master, node, ERASES, 0x40, 0)[4];
        asked(&mut world, &master, node, (0x2100, 1), 0x2F, 2);
        if personality == "lift" {
            asked(&mut world, &master, node, (0x2305, 0), 0x2F, 1);
        }
        world.run_until(world.now() + Time::from_millis(300));
        world.take_frames();
        let (mut number, mut seen) = (0, erases(&mut world));
        for phase in (first..PHASES).step_by(2) {
            while erases(&mut world) == seen {
                number += 1;
                asked(&mut world, &master, node, APPLICATION, 0x2B, 1000 + number);
                let millisecond = world.now().as_micros() / 1000 + 6;
                world.run_until(Time::from_micros(millisecond * 1000 + phase * 1000 / PHASES));
                asked(&mut world, &master, node, (0x1010, 3), 0x23, SAVE);
            }
            seen = erases(&mut world);
            world.run_until(world.now() + Time::from_millis(20));
            let emcy = frame(0x80 + u16::from(node), &[]).id();
            let emcys = world.take_frames().into_iter().filter(|sent| sent.frame.id() == emcy).count();
            assert_eq!(emcys, 0, "{personality}, phase {phase}");
            let state = if personality == "lift" { (0x2303, 1) } else { SENSOR_STATE };
            assert_eq!(
                asked(&mut world, &master, node, state, 0x40, 0)[4],
                0,
                "{personality}, phase {phase}"
            );
        }
        println!("{personality}: {seen} erases in {number} saves");
    }
}

/// With a short heartbeat time, an erase would be a missing heartbeat.
#[test]
fn a_short_heartbeat_time_postpones_the_erase() {
    let (mut world, master) = started("pressure", 1000);
    write(&mut world, &master, HEARTBEAT, 2, 100);
    let mut number = 0;
    while read(&mut world, &master, SAVES_LEFT) > 0 {
        number += 1;
        assert_eq!(save_change(&mut world, &master, number).0, Ok(()));
    }
    world.run_until(world.now() + SECOND * 3);
    assert_eq!(read(&mut world, &master, SAVES_LEFT), 0);
    assert!(longest_gap(&world.take_frames()) <= Time::from_millis(150));
    write(&mut world, &master, HEARTBEAT, 2, 0);
    world.run_until(world.now() + SECOND);
    assert!(read(&mut world, &master, SAVES_LEFT) > 0);
    assert_eq!(save_change(&mut world, &master, 99).0, Ok(()));
}

/// The times of docs/communication.md, in Operational, where no page is erased.
#[test]
fn a_save_takes_the_time_that_the_documents_give() {
    let cases = PERSONALITIES.into_iter().flat_map(|personality| [(personality, false), (personality, true)]);
    for (personality, with_tpdo) in cases.filter(|case| *case != ("lift", true)) {
        let (mut world, master) = started(personality, 1000);
        if with_tpdo {
            write(&mut world, &master, (0x1800, 5), 2, 1);
        }
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        world.run_until(world.now() + Time::from_millis(100));
        let mut stored = vec![(COMMUNICATION, 4, (0x1010, 2)), (APPLICATION, 2, (0x1010, 3))];
        if personality == "encoder" {
            stored.push((PRESET, 4, PRESET));
        }
        let mut times = vec![vec![]; stored.len()];
        for number in 1..=8 {
            for (times, &(object, size, save)) in times.iter_mut().zip(&stored) {
                if save != object {
                    write(&mut world, &master, object, size, number);
                }
                let value = if save == object { number } else { SAVE };
                let (result, time) = store(&mut world, &master, save, value);
                assert_eq!(result, Ok(()));
                times.push(time);
            }
        }
        let tpdo = if with_tpdo { ", a TPDO every millisecond" } else { "" };
        for ((object, ..), times) in stored.iter().zip(&mut times) {
            times.sort_unstable();
            let ms = |time: Time| time.as_micros() as f64 / 1000.0;
            let (median, most) = (ms(times[times.len() / 2]), ms(times[times.len() - 1]));
            println!(
                "{personality}{tpdo}: {:x}h is stored after {median:.1} ms, {most:.1} ms at most",
                object.0
            );
            assert!(median < 12.0 && most < 35.0, "{personality}: {median}, {most}");
        }
    }
}
