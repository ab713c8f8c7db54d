//! Receive FIFOs: depth, overrun, locked mode, interrupts.

use canbus::{Time, frame_bits};

use crate::rig::*;

const FULL: u32 = 1 << 3;
const FOVR: u32 = 1 << 4;

fn flood(rig: &mut Rig, frames: u16) {
    (1..=frames).for_each(|id| rig.hosts[0].send(standard(id, &[id as u8]), rig.now));
    rig.run(Time::from_millis(2));
}

fn drain(rig: &mut Rig, fifo: usize) -> Vec<u32> {
    std::iter::from_fn(|| rig.take(0, fifo)).map(|(id, _)| id).collect()
}

#[test]
fn a_frame_arrives_with_the_last_but_one_bit_of_its_end() {
    let mut rig = Rig::started(1, 1, 0);
    rig.write(0, IER, 1 << 1);
    let frame = standard(5, &[1, 2]);
    rig.hosts[0].send(frame, rig.now);
    rig.run(BIT * (frame_bits(&frame) - 4) - Time(1));
    assert!(!rig.chips[0].lines()[0].rx0);
    rig.run(Time(1));
    assert!(rig.chips[0].lines()[0].rx0);
    assert_eq!(rig.take(0, 0), Some((5, vec![1, 2])));
    assert!(!rig.chips[0].lines()[0].rx0);
}

#[test]
fn three_frames_fill_a_fifo() {
    let mut rig = Rig::started(1, 1, 0);
    flood(&mut rig, 2);
    assert_eq!(rig.read(0, RF0R), 2);
    flood(&mut rig, 1);
    assert_eq!(rig.read(0, RF0R), 3 | FULL);
    rig.write(0, RF0R, FULL);
    assert_eq!(rig.read(0, RF0R), 3);
    assert_eq!(drain(&mut rig, 0), [1, 2, 1]);
    rig.write(0, RF0R, RFOM);
    assert_eq!(rig.read(0, RF0R), 0, "an empty FIFO has nothing to release");
}

#[test]
fn a_mailbox_that_is_given_back_stays_for_a_while() {
    let mut rig = Rig::started(1, 1, 0);
    flood(&mut rig, 2);
    let first = rig.read(0, RX[0]);
    rig.write(0, RF0R, RFOM);
    rig.write(0, RF0R, RFOM);
    assert_eq!((rig.read(0, RF0R), rig.read(0, RX[0])), (2 | RFOM, first));
    rig.run(Time::from_micros(1));
    assert_eq!(rig.read(0, RF0R), 1, "to ask twice gives one back");
    assert_ne!(rig.read(0, RX[0]), first);
}

#[test]
fn an_overrun_loses_the_newest_but_one_or_locked_the_newest() {
    for (options, kept) in [(0, [1, 2, 5]), (RFLM, [1, 2, 3])] {
        let mut rig = Rig::started(1, 1, options);
        flood(&mut rig, 5);
        assert_eq!(rig.read(0, RF0R), 3 | FULL | FOVR);
        rig.write(0, RF0R, FOVR | FULL);
        assert_eq!(drain(&mut rig, 0), kept);
        let reception = rig.chips[0].can1.reception();
        assert_eq!((reception.accepted, reception.lost), (5, 2));
    }
}

#[test]
fn each_fifo_has_its_enables_and_its_line() {
    for fifo in 0..2 {
        let mut rig = Rig::new(1, 1);
        rig.initialise(0, ONE_MEGABIT);
        rig.write(0, FFA1R, fifo);
        rig.accept_all(0);
        rig.write(0, MCR, 0);
        rig.run(BIT * 11);
        flood(&mut rig, 4);
        let mut seen = Vec::new();
        for enable in 1..=6 {
            rig.write(0, IER, 1 << enable);
            let lines = rig.chips[0].lines()[0];
            seen.push((lines.rx0, lines.rx1));
        }
        let (own, other) = ((fifo == 0, fifo == 1), (false, false));
        let expected = if fifo == 0 {
            [own, own, own, other, other, other]
        } else {
            [other, other, other, own, own, own]
        };
        assert_eq!(seen, expected);
    }
}

#[test]
fn a_remote_frame_reads_without_data() {
    let mut rig = Rig::started(1, 1, 0);
    let id = canbus::StandardId::new(0x77).unwrap();
    rig.hosts[0].send(canbus::Frame::remote(id, 4).unwrap(), rig.now);
    rig.run(Time::from_millis(1));
    assert_eq!(rig.read(0, RX[0]), 0x77 << 21 | 1 << 1);
    assert_eq!(rig.read(0, RX[0] + 4) & 0xF, 0);
}

#[test]
fn a_filtered_frame_is_acknowledged() {
    let mut rig = Rig::started(1, 1, 0);
    rig.write(0, FA1R, 0);
    flood(&mut rig, 1);
    assert_eq!((rig.hosts[0].backlog(), rig.read(0, RF0R)), (0, 0));
}
