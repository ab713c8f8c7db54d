//! The stored configuration of a node, and the configuration of node-ID and bit rate.

use canbus::Time;
use sim::traffic::NmtState;
use sim::world::World;

use crate::support::{LSS_REQUEST, Master, SECOND, START_ALL, run, world};

const fn ms(milliseconds: u64) -> Time {
    Time::from_millis(milliseconds)
}

/// A download of up to four bytes; returns the response.
fn write(world: &mut World, master: &Master, index: u16, sub: u8, value: &[u8]) -> Vec<u8> {
    let unused = 4 - value.len();
    let mut request = [0; 8];
    request[0] = 0x23 | (unused as u8) << 2;
    request[1..3].copy_from_slice(&index.to_le_bytes());
    request[3] = sub;
    request[4..4 + value.len()].copy_from_slice(value);
    master.ask(world, 1, &request)
}

fn read16(world: &mut World, master: &Master, index: u16, sub: u8) -> u16 {
    let [low, high] = index.to_le_bytes();
    let response = master.ask(world, 1, &[0x40, low, high, sub, 0, 0, 0, 0]);
    assert_eq!(response[0], 0x4B, "{response:x?}");
    u16::from_le_bytes([response[4], response[5]])
}

/// Switches the power off and on, and waits until the node has booted.
fn power_cycle(world: &mut World, board: usize) {
    let now = world.now();
    world.machine(board).power_on(now);
    world.run_until(now + SECOND);
}

#[test]
fn saved_parameters_survive_a_power_cycle_and_a_save_costs_no_sample_and_no_frame() {
    let mut world = world("--bitrate 1000 --load 90 --pressure const:250000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    assert_eq!(write(&mut world, &master, 0x1017, 0, &500_u16.to_le_bytes())[0], 0x60);
    assert_eq!(write(&mut world, &master, 0x4000, 16, &[1, 2, 3, 4])[0], 0x60);
    let before = run(&mut world, ms(100));
    assert_eq!(write(&mut world, &master, 0x1010, 1, b"save")[0], 0x60);
    let after = run(&mut world, SECOND);
    let (sampling, lost) = (&after.nodes[0].sampling, after.nodes[0].receiving.lost);
    let span = after.virtual_seconds - before.virtual_seconds;
    let samples = sampling.samples - before.nodes[0].sampling.samples;
    println!("{samples} samples in {span:.3} s, worst jitter {:.2} us", sampling.worst_jitter);
    assert!((samples as f64 - span * 1000.0).abs() < 2.0, "{samples} samples in {span} s");
    assert!(sampling.worst_jitter < 30.0, "one word is programmed in 16 us: {} us", sampling.worst_jitter);
    assert_eq!(lost, 0);

    power_cycle(&mut world, 0);
    assert_eq!(read16(&mut world, &master, 0x1017, 0), 500);
    let word = master.ask(&mut world, 1, &[0x40, 0, 0x40, 16, 0, 0, 0, 0]);
    assert_eq!(word, [0x43, 0, 0x40, 16, 1, 2, 3, 4]);

    assert_eq!(write(&mut world, &master, 0x1011, 1, b"load")[0], 0x60);
    power_cycle(&mut world, 0);
    assert_eq!(read16(&mut world, &master, 0x1017, 0), 1000);
}

#[test]
fn pages_that_fill_up_are_erased_by_a_restart_and_lose_nothing() {
    let mut world = world("--bitrate 1000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    // In Pre-operational the node would erase a page and go on.
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    let mut last = 0;
    let full = (0..200_u16).find(|&number| {
        write(&mut world, &master, 0x1017, 0, &(1000 + number).to_le_bytes());
        let response = write(&mut world, &master, 0x1010, 1, b"save");
        if response[0] == 0x60 {
            last = 1000 + number;
            return false;
        }
        // "Cannot be stored because of the present device state".
        assert_eq!(response[4..], [0x22, 0, 0, 8]);
        true
    });
    assert!(full.is_some_and(|number| number > 20), "{full:?}");
    power_cycle(&mut world, 0);
    assert_eq!(read16(&mut world, &master, 0x1017, 0), last);
    assert_eq!(write(&mut world, &master, 0x1010, 1, b"save")[0], 0x60, "there is room again");
}

/// Finds one unconfigured node by fastscan; returns its identity.
fn fastscan(world: &mut World, master: &Master) -> Option<[u32; 4]> {
    let mut scan = |value: u32, bit: u8, part: u8, next: u8| {
        let [a, b, c, d] = value.to_le_bytes();
        !master.lss(world, &[0x51, a, b, c, d, bit, part, next]).is_empty()
    };
    if !scan(0, 0x80, 0, 0) {
        return None;
    }
    let mut identity = [0; 4];
    for part in 0..4 {
        let mut value = 0;
        for bit in (0..32).rev() {
            value |= u32::from(!scan(value, bit, part, part)) << bit;
        }
        assert!(scan(value, 0, part, (part + 1) % 4));
        identity[usize::from(part)] = value;
    }
    Some(identity)
}

#[test]
fn three_nodes_without_a_node_id_are_found_by_fastscan_and_keep_their_new_ids() {
    let mut world = world("--bitrate 500 --node 201:pressure --node 202:pressure --node 203:pressure");
    let master = Master::join_at(&mut world, 500_000);
    world.run_until(SECOND);
    assert!(world.take_frames().is_empty(), "they are silent");
    let mut serials = vec![];
    for id in [10, 20, 30] {
        let [vendor, product, _, serial] = fastscan(&mut world, &master).expect("one more");
        assert_eq!(
            (vendor, product),
            (profiles::product::VENDOR_ID, node::Personality::Pressure.product_code())
        );
        serials.push(serial);
        assert_eq!(master.lss(&mut world, &[0x11, id, 0, 0, 0, 0, 0, 0]), [[0x11, 0, 0, 0, 0, 0, 0, 0]]);
        assert_eq!(master.lss(&mut world, &[0x17, 0, 0, 0, 0, 0, 0, 0]), [[0x17, 0, 0, 0, 0, 0, 0, 0]]);
        assert!(master.lss(&mut world, &[0x04, 0, 0, 0, 0, 0, 0, 0]).is_empty());
        world.run_until(world.now() + ms(100));
        assert_eq!(world.traffic().node(id).boot_ups, 1);
    }
    assert_eq!(fastscan(&mut world, &master), None);
    serials.sort_unstable();
    serials.dedup();
    assert_eq!(serials.len(), 3);

    (0..3).for_each(|board| power_cycle(&mut world, board));
    for id in [10, 20, 30] {
        assert_eq!(world.traffic().node(id).boot_ups, 2);
        assert_eq!(master.ask(&mut world, id, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])[4..], [0x94, 1, 2, 0]);
    }
}

#[test]
fn lss_moves_a_node_to_another_bit_rate_for_good() {
    let mut moving = world("--bitrate 250");
    let master = Master::join_at(&mut moving, 250_000);
    moving.run_until(SECOND);
    master.lss(&mut moving, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(master.lss(&mut moving, &[0x13, 0, 2, 0, 0, 0, 0, 0])[0][..2], [0x13, 0]);
    assert_eq!(master.lss(&mut moving, &[0x17, 0, 0, 0, 0, 0, 0, 0])[0][..2], [0x17, 0]);
    let [low, high] = 200_u16.to_le_bytes();
    master.send(&mut moving, LSS_REQUEST, &[0x15, low, high, 0, 0, 0, 0, 0]);
    let switched = moving.now() + ms(200);
    moving.run_until(switched);
    moving.take_frames();
    moving.run_until(switched + ms(200));
    assert!(moving.take_frames().is_empty(), "silence around the switch");
    moving.run_until(switched + ms(300));
    assert_eq!(master.ask(&mut moving, 1, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])[4..], [0x94, 1, 2, 0]);
    power_cycle(&mut moving, 0);
    assert_eq!(master.ask(&mut moving, 1, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])[4..], [0x94, 1, 2, 0]);
    assert_eq!(run(&mut moving, SECOND).bus.errors, 0);
}

/// At every bit rate, on a bus with a frame every 50 ms that other nodes acknowledge.
#[test]
fn a_node_detects_the_bit_rate_without_disturbing_the_bus() {
    for rate in [10, 20, 50, 125, 250, 500, 800, 1000] {
        let mut world = world(&format!("--bitrate {rate} --node 1:pressure --node 5:pressure@auto"));
        let master = Master::join_at(&mut world, rate * 1000);
        let found = (1..200).find(|&look| {
            world.run_until(ms(50 * look));
            master.send(&mut world, 0x77F, &[5]);
            world.traffic().node(5).boot_ups > 0
        });
        assert!(found.is_some(), "{rate} kbit/s");
        println!("{rate} kbit/s: found after {} ms", 50 * found.unwrap());
        let summary = run(&mut world, SECOND);
        assert_eq!(summary.bus.errors, 0, "{rate} kbit/s: {summary}");
        assert_eq!(world.traffic().node(5).state, NmtState::PreOperational);
    }
}

/// A board without a device record beside a node of this bit rate, after it has detected the rate.
fn new_board(rate: u32) -> (World, Master) {
    const PAGES: u32 = 0x0800_8000;
    const SIZE: usize = 0x8000;
    let mut world = world(&format!("--bitrate {rate} --node 1:pressure --node 9:lift"));
    let master = Master::join_at(&mut world, rate * 1000);
    world.machine(0).write(PAGES, &[0xFF; SIZE]).unwrap();
    world.machine(0).power_off();
    world.machine(0).power_on(Time::from_millis(1));
    assert!(boots(&mut world, &master, 1), "{rate} kbit/s");
    (world, master)
}

/// Sends frames until a node boots up. Returns whether it does within ten seconds.
fn boots(world: &mut World, master: &Master, node: u8) -> bool {
    let before = world.traffic().node(node).boot_ups;
    (0..200).any(|_| {
        let next = world.now() + ms(50);
        world.run_until(next);
        master.send(world, 0x77F, &[5]);
        world.traffic().node(node).boot_ups > before
    })
}

/// Selects the pressure node alone for LSS, by its identity.
fn select(world: &mut World, master: &Master) {
    for part in 1..=4_u8 {
        let value = master.ask(world, 1, &[0x40, 0x18, 0x10, part, 0, 0, 0, 0])[4..].to_vec();
        let request = [0x3F + part, value[0], value[1], value[2], value[3], 0, 0, 0];
        master.send(world, LSS_REQUEST, &request);
        world.run_until(world.now() + ms(50));
    }
}

/// With another rate the node would disturb the bus after its next start.
#[test]
fn a_new_board_that_stores_a_setting_keeps_the_bit_rate_of_the_bus() {
    for rate in [1000, 500, 125, 50] {
        let (mut world, master) = new_board(rate);
        assert_eq!(write(&mut world, &master, 0x2000, 0, &[1])[0], 0x60, "{rate} kbit/s");
        master.send(&mut world, 0, &[0x81, 1]);
        assert!(boots(&mut world, &master, 1), "{rate} kbit/s, personality");
        assert_eq!(device_type(&mut world, &master), [0x96, 1, 5, 0], "{rate} kbit/s");
        select(&mut world, &master);
        for request in [[0x11, 40], [0x17, 0]] {
            let answers = master.lss(&mut world, &[request[0], request[1], 0, 0, 0, 0, 0, 0]);
            assert_eq!(answers[0][..2], [request[0], 0], "{rate} kbit/s");
        }
        master.send(&mut world, LSS_REQUEST, &[0x04, 0, 0, 0, 0, 0, 0, 0]);
        world.run_until(world.now() + SECOND);
        let now = world.now();
        world.machine(0).power_off();
        world.machine(0).power_on(now);
        assert!(boots(&mut world, &master, 40), "{rate} kbit/s, node-ID");
        assert_eq!(run(&mut world, SECOND).bus.errors, 0, "{rate} kbit/s");
    }
}

/// Without *configure bit timing* the active bit timing stays (CiA 305).
#[test]
fn a_new_board_that_activates_no_bit_rate_keeps_that_of_the_bus() {
    for rate in [1000, 500, 125, 50] {
        let (mut world, master) = new_board(rate);
        select(&mut world, &master);
        master.send(&mut world, LSS_REQUEST, &[0x15, 100, 0, 0, 0, 0, 0, 0]);
        world.run_until(world.now() + ms(300));
        for _ in 0..100 {
            world.run_until(world.now() + ms(50));
            master.send(&mut world, 0x77F, &[5]);
        }
        assert_eq!(device_type(&mut world, &master), [0x94, 1, 2, 0], "{rate} kbit/s");
        assert_eq!(run(&mut world, SECOND).bus.errors, 0, "{rate} kbit/s");
    }
}

/// A frame that ends while the node moves on to the next rate was received at the previous rate. The test sends long
/// frames at every phase. The node may miss some of them, but must never take one for a frame at another rate, because
/// it would then destroy frames on the bus.
#[test]
fn a_frame_of_the_rate_before_is_not_taken_for_one_of_the_next() {
    for rate in [10, 20, 50, 125] {
        for phase in 0..6 {
            let mut world = world(&format!("--bitrate {rate} --node 1:pressure --node 5:pressure@auto"));
            let master = Master::join_at(&mut world, rate * 1000);
            let found = (0..150).any(|look| {
                world.run_until(Time::from_micros(3_001 * phase + 41_003 * look));
                master.send(&mut world, 0x77F, &[0x55; 8]);
                world.traffic().node(5).boot_ups > 0
            });
            let summary = run(&mut world, SECOND);
            assert_eq!(summary.bus.errors, 0, "{rate} kbit/s, phase {phase}: {summary}");
            assert!(summary.nodes.iter().all(|node| node.incidents.is_empty()), "{summary}");
            assert!(found, "{rate} kbit/s, phase {phase}");
        }
    }
}

#[test]
fn program_control_restarts_without_an_answer() {
    let mut world = world("--bitrate 1000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    assert_eq!(write(&mut world, &master, 0x1F51, 1, &[3])[4..], [0x30, 0, 9, 6]);
    assert_eq!(write(&mut world, &master, 0x1F51, 1, &[1])[0], 0x60, "it runs already");
    master.send(&mut world, 0x601, &[0x2F, 0x51, 0x1F, 1, 0, 0, 0, 0]);
    world.run_until(world.now() + SECOND);
    assert!(master.heard(&mut world, 0x581).is_empty());
    assert_eq!(world.traffic().node(1).boot_ups, 2);
}

fn device_type(world: &mut World, master: &Master) -> Vec<u8> {
    master.ask(world, 1, &[0x40, 0, 0x10, 0, 0, 0, 0, 0])[4..].to_vec()
}

#[test]
fn a_node_has_the_personality_of_the_command_line_and_then_that_of_sdo() {
    let types = [0x0002_0194_u32, 0x0005_0196, 0xFFFF_0196, 0x0000_01A1].map(u32::to_le_bytes);
    for (number, name) in ["pressure", "encoder", "combined", "lift"].into_iter().enumerate() {
        let mut world = world(&format!("--bitrate 1000 --node 1:{name}"));
        let master = Master::join(&mut world);
        world.run_until(SECOND);
        assert_eq!(device_type(&mut world, &master), types[number]);
        let other = (number + 1) % types.len();
        assert_eq!(write(&mut world, &master, 0x2000, 0, &[other as u8])[0], 0x60);
        assert_eq!(device_type(&mut world, &master), types[number], "not before a reset");
        master.send(&mut world, 0, &[0x81, 1]);
        let reset = world.now();
        world.run_until(reset + SECOND);
        assert_eq!(device_type(&mut world, &master), types[other]);
    }
}
