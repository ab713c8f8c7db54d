//! Undisturbed nodes, and their cost.

use canbus::Time;
use sim::board::Programs;
use sim::port::Adapter;
use sim::stimuli::Stimulus;
use sim::summary::Summary;
use sim::traffic::NmtState;

use crate::support::{
    Master, SDO_REQUEST, SDO_RESPONSE, SECOND, START_ALL, SYNC, TPDO1, frame, read, run, world,
};

/// Checks that the run had no errors and no incidents.
fn assert_clean(summary: &Summary) {
    assert_eq!(summary.bus.errors, 0);
    for node in &summary.nodes {
        assert_eq!((node.heard.boot_ups, node.heard.emcys, node.receiving.lost), (1, 0, 0), "{summary}");
        assert!(node.incidents.is_empty() && node.unmodelled.is_empty(), "{summary}");
    }
}

/// `cargo sim --node 1:pressure --for 10 --speed max`: the summary shows heartbeats and TPDOs.
#[test]
fn a_node_alone_boots_and_sends_heartbeats_and_tpdos() {
    let mut world = world("--node 1:pressure");
    let summary = run(&mut world, Time::from_millis(10_000));
    println!("{summary}");
    assert_clean(&summary);
    let node = &summary.nodes[0];
    assert!((9..=10).contains(&node.heard.heartbeats), "{summary}");
    assert!((8..=11).contains(&node.heard.tpdos), "{summary}");
}

/// Even a node that is started immediately after its boot-up sends a measured value, not one from before its first
/// sample.
#[test]
fn the_first_tpdo_carries_a_sample() {
    let mut world = world("--pressure const:250000");
    world.run_until(SECOND);
    let frames = world.take_frames();
    let first = frames.iter().find(|stamped| stamped.frame.id() == frame(TPDO1, &[]).id()).unwrap();
    let bar = f32::from_le_bytes(first.frame.bytes()[..4].try_into().unwrap());
    assert!((bar - 2.5).abs() < 0.004, "{bar} bar for 250000 Pa");
}

/// A full bus of foreign frames at 1 Mbit/s, a thousand SYNCs a second, and SDO requests as fast as they are answered.
/// Sampling keeps its pace, and no frame for the node is lost. The client's period differs from that of the samples, so
/// that its frames come at every phase of the millisecond.
#[test]
fn sampling_keeps_its_pace_on_a_full_bus() {
    const SYNCS: u64 = 2000;
    const BEAT: Time = Time::from_micros(997);
    let mut world = world("--bitrate 1000 --load 100 --pressure const:250000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, SDO_REQUEST, &[0x2F, 0x00, 0x18, 0x02, 1, 0, 0, 0]);
    world.run_until(SECOND + Time::from_millis(10));
    assert_eq!(
        master.heard(&mut world, SDO_RESPONSE),
        [frame(SDO_RESPONSE, &[0x60, 0x00, 0x18, 0x02, 0, 0, 0, 0])]
    );
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    world.run_until(SECOND + Time::from_millis(20));
    let before = world.summary(1.0, 0);

    let (mut requests, mut responses) = (0, 0);
    for _ in 0..SYNCS {
        master.send(&mut world, SYNC, &[]);
        if requests == responses {
            master.send(&mut world, SDO_REQUEST, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
            requests += 1;
        }
        world.run_until(world.now() + BEAT);
        responses += master.heard(&mut world, SDO_RESPONSE).len();
    }
    let after = run(&mut world, Time::from_millis(5));
    responses += master.heard(&mut world, SDO_RESPONSE).len();
    let tpdos = after.nodes[0].heard.tpdos - before.nodes[0].heard.tpdos;

    let sampling = after.nodes[0].sampling;
    println!(
        "worst start jitter of sampling: {:.3} us; bus load {:.2} %",
        sampling.worst_jitter,
        after.bus.load * 100.0
    );
    println!("{after}");
    assert_clean(&after);
    assert!(after.bus.load > 0.99);
    // A lock may delay the first and the last start: a microsecond in the seconds between them.
    assert!((sampling.rate - 1000.0).abs() < 1e-3, "{} samples a second", sampling.rate);
    assert!(sampling.worst_jitter < 20.0, "{} us", sampling.worst_jitter);
    assert_eq!(responses, requests, "every SDO request is answered");
    assert!(requests as u64 > SYNCS / 2, "an answer comes within two milliseconds");
    assert_eq!(tpdos, SYNCS, "every SYNC is answered");
    for kind in 1..=8 {
        assert_eq!(read(&mut world, &master, (0x2001, kind)), 0, "lost events of kind {kind}");
    }
}

/// One frame in twenty is destroyed by a bit error: the controllers repeat it, and every request is answered once.
#[test]
fn a_disturbed_bus_loses_nothing() {
    const REQUESTS: usize = 200;
    let mut world = world("--bitrate 1000");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    world.bus().faults.noise(1, 0.05);
    let mut responses = 0;
    for _ in 0..REQUESTS {
        master.send(&mut world, SDO_REQUEST, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        world.run_until(world.now() + Time::from_millis(5));
        responses += master.heard(&mut world, SDO_RESPONSE).len();
    }
    let summary = world.summary(1.0, 0);
    assert_eq!(responses, REQUESTS);
    assert!(summary.bus.errors > 10, "{summary}");
    assert_eq!((summary.nodes[0].heard.emcys, summary.nodes[0].receiving.lost), (0, 0), "{summary}");
}

/// The cost of a node. Instructions are exact; the ratio depends on the host and is only printed.
#[test]
fn a_node_is_cheap() {
    let mut world = world("--bitrate 1000 --pressure sine:250000,100000,2");
    let master = Master::join(&mut world);
    world.run_until(SECOND);
    master.send(&mut world, START_ALL.0, &START_ALL.1);
    let before = world.summary(1.0, 0).nodes[0].cpu.instructions;
    let summary = run(&mut world, Time::from_millis(5_000));
    let node = &summary.nodes[0];
    let host = summary.host_seconds / 5.0;
    println!("{summary}one second of one node takes {host:.3} s of the host");
    assert_clean(&summary);
    assert!((1.0..=20_000.0).contains(&node.sampling.instructions), "{summary}");
    assert!((1.0..=5_000.0).contains(&node.receiving.instructions), "{summary}");
    assert!(
        node.cpu.instructions - before < 5 * 25_000_000,
        "instructions decide what a second costs: {summary}"
    );
    assert!(node.cpu.load < 0.5, "{summary}");
    assert!(node.memory.flash > 0 && node.memory.flash <= 192 * 1024, "{summary}");
    assert!(node.memory.ram > 0 && node.memory.stack > 0 && node.memory.stack < 20 * 1024, "{summary}");
}

/// Two equal runs give the same bus log, bit for bit, with two nodes, noise, foreign traffic and a client. Another seed
/// of the noise gives another log, which shows that the log is sensitive to differences.
#[test]
fn the_same_run_gives_the_same_bus_log() {
    let log = |seed: u32| {
        let noise = format!("--node 1 --node 2 --bitrate 500 --load 60 --pressure noise:250000,2000,{seed}");
        let mut world = world(&noise);
        let port = world.open_port();
        world.port(port).attach(Some(Adapter { bit_rate: 500_000, silent: false }));
        let master = Master { port };
        world.run_until(SECOND);
        master.send(&mut world, START_ALL.0, &START_ALL.1);
        world.run_until(Time::from_millis(3_000));
        assert_eq!(world.traffic().node(2).state, NmtState::Operational);
        world.take_frames()
    };
    let first = log(7);
    assert!(first.len() > 1000);
    assert!(first == log(7), "the logs differ");
    assert!(first != log(8), "noise does not reach the bus");
}

/// A kept flash is not written again: it may hold an update or a manipulated program, which then runs. --reflash writes
/// the images again. The parameters stay in both cases.
#[test]
fn a_kept_flash_is_not_written_without_being_asked() {
    let dir = std::env::temp_dir().join(format!("board-kept-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    let flags = format!("--node 5:pressure --flash {}", dir.display());
    let programs = |flags: &str| world(flags).boards()[0].programs();
    assert_eq!(programs(&flags), Programs::Written);

    let mut flash = world(&flags).boards()[0].flash();
    sim::flash::save(&dir, 5, &flash).unwrap();
    assert_eq!(programs(&flags), Programs::Kept);
    const IN_THE_APPLICATION: usize = 0x2_1000;
    flash[IN_THE_APPLICATION] ^= 1;
    sim::flash::save(&dir, 5, &flash).unwrap();
    let tampered = world(&flags);
    assert_eq!(tampered.boards()[0].programs(), Programs::Others);
    assert!(tampered.boards()[0].flash() == flash, "it stays as it is");
    assert_eq!(programs(&format!("{flags} --reflash")), Programs::Written);
    std::fs::remove_dir_all(dir).unwrap();
}

/// A stimulus for a board that does not exist is refused, not ignored.
#[test]
fn a_stimulus_for_an_unknown_node_is_refused() {
    let mut world = world("--node 1");
    let refused = world.apply(&Stimulus::parse("pressure", "5=const:1").unwrap()).unwrap_err();
    assert_eq!(refused.to_string(), "there is no node 5 here");
}

/// A board with a kept flash starts as it was left; the personality and node-ID on the command line are ignored.
#[test]
fn a_kept_flash_keeps_the_node_id() {
    let dir = std::env::temp_dir().join(format!("board-flash-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&dir);
    let flags = format!("--node 5:pressure --flash {}", dir.display());
    let first = world(&flags);
    sim::flash::save(&dir, 5, &first.boards()[0].flash()).unwrap();
    std::fs::rename(sim::flash::file(&dir, 5), sim::flash::file(&dir, 9)).unwrap();
    let mut second = world(&flags.replace("5:", "9:"));
    second.run_until(SECOND + SECOND);
    assert_eq!(second.traffic().node(5).boot_ups, 1, "it still is node 5");
    std::fs::remove_dir_all(dir).unwrap();
}
