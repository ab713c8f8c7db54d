//! Transmit mailboxes: priority, CODE, abort, outcomes, interrupts.

use canbus::{Time, frame_bits};
use proptest::prelude::*;

use crate::rig::*;

const TME: [u32; 3] = [1 << 26, 1 << 27, 1 << 28];

fn code(rig: &mut Rig) -> u32 {
    rig.read(0, TSR) >> 24 & 3
}

fn low(rig: &mut Rig) -> u32 {
    rig.read(0, TSR) >> 29
}

/// A chip whose bus is held by a host frame, so that its own requests stay pending.
fn blocked(options: u32) -> Rig {
    let mut rig = Rig::started(1, 2, options);
    rig.hosts[0].send(standard(0, &[0; 8]), rig.now);
    rig.run(BIT);
    rig
}

fn received(rig: &mut Rig) -> Vec<u32> {
    std::iter::from_fn(|| rig.hosts[1].receive()).skip(1).map(|r| r.frame.arbitration() >> 21).collect()
}

#[test]
fn two_chips_talk() {
    let mut rig = Rig::started(2, 0, ABOM);
    rig.request(0, 0, &standard(0x181, &[1, 2, 3, 4, 5, 6, 7, 8]));
    rig.request(1, 0, &standard(0x182, &[9]));
    rig.run(Time::from_millis(1));
    assert_eq!(rig.take(1, 0), Some((0x181, vec![1, 2, 3, 4, 5, 6, 7, 8])));
    assert_eq!(rig.take(0, 0), Some((0x182, vec![9])));
    assert_eq!(rig.read(0, TSR) & 0xFF, 0b0011, "RQCP and TXOK");
    assert_eq!(rig.read(1, TSR) & 0xFF, 0b0011, "the lost arbitration is history");
}

#[test]
fn a_sent_frame_interrupts_at_the_end_of_frame() {
    let mut rig = Rig::started(1, 1, 0);
    rig.write(0, IER, 1);
    let frame = standard(0x181, &[1]);
    rig.request(0, 2, &frame);
    assert_eq!(rig.read(0, TSR) & TME[2], 0);
    rig.run(BIT * (frame_bits(&frame) - 3) - Time(1));
    assert!(!rig.chips[0].lines()[0].tx);
    rig.run(Time(1));
    assert!(rig.chips[0].lines()[0].tx);
    assert_eq!(rig.read(0, TSR) & (TME[2] | 0xFF << 16), TME[2] | 0b0011 << 16);
    // Clearing RQCP also clears TXOK.
    rig.write(0, TSR, 1 << 16);
    assert_eq!(rig.read(0, TSR), 0x1C00_0000);
    assert!(!rig.chips[0].lines()[0].tx);
}

#[test]
fn code_names_the_next_free_mailbox_and_then_the_lowest_priority() {
    let mut rig = blocked(0);
    assert_eq!((code(&mut rig), low(&mut rig)), (0, 0));
    rig.request(0, 0, &standard(0x300, &[]));
    assert_eq!((code(&mut rig), low(&mut rig)), (1, 0), "LOW needs two pending ones");
    rig.request(0, 1, &standard(0x100, &[]));
    assert_eq!((code(&mut rig), low(&mut rig)), (2, 0b001));
    rig.request(0, 2, &standard(0x400, &[]));
    assert_eq!((code(&mut rig), low(&mut rig)), (2, 0b100));
    rig.run(Time::from_millis(1));
    assert_eq!(received(&mut rig), [0x100, 0x300, 0x400]);
}

#[test]
fn by_request_order() {
    let mut rig = blocked(TXFP);
    for (mailbox, id) in [(1, 0x300), (2, 0x200), (0, 0x100)] {
        rig.request(0, mailbox, &standard(id, &[]));
    }
    assert_eq!((code(&mut rig), low(&mut rig)), (0, 0b001));
    rig.run(Time::from_millis(1));
    assert_eq!(received(&mut rig), [0x300, 0x200, 0x100]);
}

#[test]
fn a_pending_mailbox_is_write_protected_and_aborted_at_once() {
    let mut rig = blocked(0);
    rig.request(0, 0, &standard(0x300, &[1]));
    rig.write(0, TX[0], 0);
    rig.write(0, TX[0] + 8, 99);
    assert_eq!((rig.read(0, TX[0]), rig.read(0, TX[0] + 8)), (0x300 << 21 | 1, 1));
    rig.write(0, TSR, 1 << 7);
    assert_eq!(rig.read(0, TSR) & (TME[0] | 0xFF), TME[0] | 1, "completed, not sent");
    assert_eq!(rig.read(0, TX[0]), 0x300 << 21, "the frame can be read back");
    rig.run(Time::from_millis(1));
    assert_eq!(received(&mut rig), []);
    // An abort without a request has no effect.
    rig.write(0, TSR, 1);
    rig.write(0, TSR, 1 << 7);
    assert_eq!(rig.read(0, TSR) & 0xFF, 0);
}

#[test]
fn on_the_wire_an_abort_waits_for_the_outcome() {
    let mut rig = Rig::started(1, 1, 0);
    rig.request(0, 0, &standard(0x300, &[1]));
    rig.run(BIT);
    rig.write(0, TSR, 1 << 7);
    assert_eq!(rig.read(0, TSR) & (TME[0] | 0xFF), 1 << 7);
    rig.run(Time::from_millis(1));
    assert_eq!(rig.read(0, TSR) & (TME[0] | 0xFF), TME[0] | 0b0011, "it was sent");

    let mut alone = Rig::started(1, 0, 0);
    alone.request(0, 0, &standard(0x300, &[1]));
    alone.run(BIT);
    alone.write(0, TSR, 1 << 7);
    alone.run(Time::from_millis(1));
    assert_eq!(alone.read(0, TSR) & (TME[0] | 0xFF), TME[0] | 0b1001, "RQCP and TERR");
    assert_eq!(alone.bus.frames(), 1);
}

#[test]
fn a_lost_arbitration_is_shown_and_repeated_unless_nart() {
    for (options, sent) in [(0, true), (NART, false)] {
        let mut rig = blocked(options);
        rig.hosts[0].send(standard(0x10, &[0; 8]), rig.now);
        rig.request(0, 0, &standard(0x11, &[]));
        rig.run(BIT * 200);
        assert_eq!(rig.read(0, TSR) & 0xF, 0b0100 | u32::from(!sent), "ALST");
        rig.run(Time::from_millis(1));
        assert_eq!(received(&mut rig).contains(&0x11), sent);
    }
}

#[test]
fn without_retransmission_a_failure_completes_the_request() {
    let mut rig = Rig::started(1, 0, NART);
    rig.request(0, 0, &standard(0x11, &[]));
    rig.run(Time::from_millis(10));
    assert_eq!(rig.read(0, TSR) & (TME[0] | 0xFF), TME[0] | 0b1001);
    assert_eq!(rig.bus.frames(), 1);
}

#[test]
fn a_request_asks_for_a_look_at_the_bus() {
    let mut rig = Rig::started(1, 0, 0);
    rig.chips[0].take_poke();
    rig.write(0, TX[0] + 8, 1);
    assert!(!rig.chips[0].take_poke());
    rig.write(0, TX[0], 1);
    assert!(rig.chips[0].take_poke());
    assert!(!rig.chips[0].take_poke());
}

proptest! {
    #![proptest_config(fixed())]

    #[test]
    fn mailboxes_go_by_identifier_and_then_by_number(ids in prop::array::uniform3(1_u16..4)) {
        let mut rig = blocked(0);
        for (mailbox, id) in ids.into_iter().enumerate() {
            rig.request(0, mailbox, &standard(id, &[mailbox as u8]));
        }
        let last = (0..3).max_by_key(|n| (ids[*n], *n)).unwrap();
        prop_assert_eq!((code(&mut rig), low(&mut rig)), (last as u32, 1 << last));
        rig.run(Time::from_millis(1));
        let order: Vec<u8> =
            std::iter::from_fn(|| rig.hosts[1].receive()).skip(1).map(|r| r.frame.bytes()[0]).collect();
        let mut expected = [0, 1, 2];
        expected.sort_by_key(|n| ids[*n as usize]);
        prop_assert_eq!(order, expected);
    }
}
