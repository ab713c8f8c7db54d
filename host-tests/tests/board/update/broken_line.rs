//! An update over a line that destroys every frame for a while: the node becomes bus-off in the middle of a command.

use canbus::Time;
use fastrand::Rng;
use host_tests::thorough::either;
use host_tests::watch::expects;
use monitor::Rule;
use sim::world::World;

use super::bench::{version_a, version_b};
use super::fleet::{Outage, PERSONALITIES, Shared, share, update_while};
use crate::broken_line::noise;
use crate::support::{Master, SECOND, frame, world};

/// Longer than the period of the heartbeat, so that each node has something to send in it.
const NOISE: Time = Time::from_millis(1500);
/// The latest beginning of the noise after that of the update, in milliseconds: the copy and the trial at any bit rate, and the
/// download.
fn latest(kbit: u64) -> u64 {
    5000 + 2_200_000 / kbit
}

#[test]
fn nodectl_completes_an_update_over_a_line_that_breaks_at_any_time() {
    let _expected = expects([Rule::HeartbeatLate]);
    let mut rng = Rng::with_seed(5);
    // The fifth case begins between the last segment and the answer that the program is valid.
    for case in 0..either(5, 48) {
        let (personality, node) = (PERSONALITIES[case % 4], [1, 16, 127][case % 3]);
        let kbit = [1000, 500, 250, 125][case % 4];
        let world: Shared = share(world(&format!("--bitrate {kbit} --node {node}:{personality}")));
        let begin = world.borrow().now() + Time::from_millis(rng.u64(..latest(kbit)));
        let image = version_b(0);
        let result = update_while(&world, &node.to_string(), &image, noise(begin, NOISE), &[]);
        let told = format!("{personality} at {node}, {kbit} kbit/s, noise from {:.3} s", begin.as_secs_f64());
        let reports = result.unwrap_or_else(|error| panic!("{told}: {error}"));
        println!("{told}: {:.1} s", world.borrow().now().as_secs_f64());
        assert!(world.borrow().now() > begin, "{told}: the update was over before");
        assert_eq!(reports[0]["result"], "updated", "{told}: {reports:?}");
        assert_eq!(reports[0]["new_identification"], image.header.code_crc(), "{told}");
        assert_eq!(reports[0]["old_identification"], version_a().header.code_crc(), "{told}");
        let summary = world.borrow().summary(1.0, 0);
        // The node resets itself for the update, and for nothing else.
        let is_clean =
            summary.nodes[0].incidents.iter().all(|incident| incident.ends_with("reset by software"));
        assert!(is_clean, "{told}: {summary}");
        assert!(summary.bus.errors > 0, "{told}: {summary}");
    }
}

/// A station that leaves the update four frames in a hundred for ten seconds: a block takes longer than the time-out of its
/// answer. The client of a second update, of a node with a smaller node-ID, is such a station.
#[test]
fn a_node_whose_frames_wait_for_more_urgent_ones_is_not_lost() {
    const MORE_URGENT: u16 = 0x101;
    const FRAMES: usize = 130;
    const PERIOD: Time = Time::from_millis(60);
    let kbit = 250;
    for (personality, node) in PERSONALITIES.into_iter().zip([1, 16, 33, 127]) {
        let world: Shared = share(world(&format!("--bitrate {kbit} --node {node}:{personality}")));
        let urgent = Master::join_at(&mut world.borrow_mut(), kbit * 1000);
        let begin = world.borrow().now() + Time::from_millis(5000);
        let mut next = begin;
        let happens = move |world: &mut World| {
            if world.now() >= next && next < begin + SECOND * 10 {
                (0..FRAMES).for_each(|_| urgent.send(world, MORE_URGENT, &[0x55; 8]));
                next += PERIOD;
            }
        };
        let reports = update_while(&world, &node.to_string(), &version_b(0), happens, &[]).unwrap();
        assert_eq!(reports[0]["result"], "updated", "{reports:?}");
        let frames = world.borrow_mut().take_frames();
        let requests = frames.iter().filter(|stamped| stamped.frame.id() == frame(0x600 + node, &[]).id());
        let data: Vec<_> = requests.map(|stamped| stamped.frame.bytes()).collect();
        assert!(
            !data.iter().any(|data| data.starts_with(&[0x80, 0x50, 0x1F, 0x01])),
            "{personality}: a block was given up"
        );
    }
}

/// A line that breaks, and one of the two nodes loses its power too: before, within or after the noise.
#[test]
fn nodectl_completes_the_update_of_two_nodes_of_which_one_loses_its_power() {
    let _expected = expects([Rule::HeartbeatLate]);
    let mut rng = Rng::with_seed(7);
    let image = version_b(0);
    let words = image.to_bytes().len() as u64 / 4;
    for case in 0..either(2, 32) {
        let nodes = [[1, 2], [16, 127], [33, 34]][case % 3];
        let personalities = [PERSONALITIES[case % 4], PERSONALITIES[(case + 1 + case / 4) % 4]];
        let kbit = [1000, 500][case % 2];
        let [first, second] = [0, 1].map(|node| format!("--node {}:{}", nodes[node], personalities[node]));
        let world: Shared = share(world(&format!("--bitrate {kbit} {first} {second}")));
        let begin = world.borrow().now() + Time::from_millis(rng.u64(..2 * latest(kbit)));
        // The download, the copy that keeps the old program, and the copy of the new one.
        let mut outage = Some(Outage::after(&world, case / 2 % 2, rng.u64(..3 * words)));
        let mut noise = noise(begin, NOISE);
        let happens = move |world: &mut World| {
            noise(world);
            outage.take_if(|outage| outage.is_over(world));
        };
        let result = update_while(&world, &format!("{},{}", nodes[0], nodes[1]), &image, happens, &[]);
        let told =
            format!("case {case}, {first} {second}, {kbit} kbit/s, noise from {:.3} s", begin.as_secs_f64());
        let reports = result.unwrap_or_else(|error| panic!("{told}: {error}"));
        for node in nodes {
            let report = reports.iter().find(|report| report["node"] == node);
            let report = report.unwrap_or_else(|| panic!("{told}: no report of {node}: {reports:?}"));
            assert_eq!(report["result"], "updated", "{told}: {reports:?}");
            assert_eq!(report["new_identification"], image.header.code_crc(), "{told}");
            assert_eq!(report["on_trial"], false, "{told}");
        }
        println!("{told}: {:.1} s", world.borrow().now().as_secs_f64());
    }
}
