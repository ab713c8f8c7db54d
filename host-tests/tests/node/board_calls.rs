//! Calls of the board to the node, in every personality: lost events (2001h), the detected bit rate, pauses for the flash.

use canopen::Duration;
use host_tests::bench::{Bench, PAGES};
use node::{BitRate, Identity, Personality};
use storage::{DeviceRecord, View};

const LOST_EVENTS: u16 = 0x2001;
const PERSONALITY: u16 = 0x2000;

#[test]
fn lost_events_are_counted_in_2001h_and_outlast_a_reset_of_the_communication() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        let counts = core::array::from_fn(|place| 100 + place as u32);
        bench.protocol.show_lost_events(&counts);
        for command in [None, Some(0x82)] {
            if let Some(command) = command {
                bench.nmt(command);
                bench.restart();
            }
            for (sub, count) in (1..).zip(counts) {
                let shown = bench.read(LOST_EVENTS, sub).unwrap();
                assert_eq!(shown, count.to_le_bytes(), "{personality:?}, {command:?}, sub-index {sub}");
            }
        }
    }
}

/// A node that has detected the bit rate stores it with its next setting.
#[test]
fn a_detected_bit_rate_is_stored_with_the_personality() {
    for (from, to) in Personality::ALL.into_iter().zip(Personality::ALL.into_iter().cycle().skip(1)) {
        let mut bench = Bench::booted_as(from);
        bench.protocol.adopt_bit_rate(BitRate::from_kbit(125).unwrap());
        bench.write(PERSONALITY, 0, &[to.number()]).unwrap();
        let record = stored(bench).expect("a record");
        assert_eq!((record.bit_rate_kbit(), record.personality()), (125, to.number()));
    }
}

/// The device record in the flash of a node.
fn stored(bench: Bench) -> Option<DeviceRecord> {
    let mut view = View::open(bench.store.into_flash(), PAGES).expect("pages");
    Identity::read(&mut view).record
}

#[test]
fn a_pause_for_the_flash_waits_until_the_node_is_not_operational_and_no_heartbeat_is_due() {
    for personality in Personality::ALL {
        let mut bench = Bench::booted_as(personality);
        let pauses = |bench: &Bench, ms| bench.protocol.can_pause(Duration::from_millis(ms), bench.now);
        bench.write(0x1017, 0, &1000_u16.to_le_bytes()).unwrap();
        assert!(pauses(&bench, 500) && !pauses(&bench, 2000), "{personality:?} in Pre-operational");
        bench.nmt(0x01);
        assert!(!pauses(&bench, 1), "{personality:?} in Operational");
        bench.nmt(0x02);
        assert!(pauses(&bench, 500), "{personality:?} in Stopped");
    }
}
