//! Operating modes, test modes, bit timing, errors and bus-off.

use canbus::{
    Attachment, BitTiming, Controller, Fault, Faults, HostNode, Position, SeenBy, Time, frame_bits,
};
use chip::can::BxCan;

use crate::rig::*;

fn mode(rig: &mut Rig) -> u32 {
    rig.read(0, MSR) & (INAK | SLAK)
}

#[test]
fn values_after_reset() {
    let mut rig = Rig::new(1, 0);
    let expected = [
        (MCR, 0x0001_0002),
        (MSR, 0x0000_0C02),
        (TSR, 0x1C00_0000),
        (RF0R, 0),
        (IER, 0),
        (ESR, 0),
        (BTR, 0x0123_0000),
        (FMR, 0x2A1C_0E01),
    ];
    for (offset, value) in expected {
        assert_eq!(rig.read(0, offset), value, "{offset:#x}");
    }
    assert_eq!(rig.chips[0].read(0x20, Time::ZERO), None);
    assert_eq!(rig.chips[0].read(0x400 + FMR, Time::ZERO), None, "CAN2 has no filter registers");
}

#[test]
fn from_sleep_to_initialisation_and_on_the_bus_after_eleven_bits() {
    let mut rig = Rig::new(1, 0);
    rig.write(0, MCR, INRQ | SLEEP);
    assert_eq!(mode(&mut rig), SLAK, "SLEEP has to be cleared too");
    rig.initialise(0, ONE_MEGABIT);
    rig.run(Time::from_millis(1));
    rig.write(0, MCR, 0);
    rig.run(Time(BIT.0 * 11 - 1));
    assert_eq!(mode(&mut rig), INAK);
    rig.run(Time(1));
    assert_eq!(mode(&mut rig), 0);
}

#[test]
fn a_busy_bus_delays_the_way_in_until_a_frame_has_ended() {
    let mut rig = Rig::new(1, 2);
    rig.initialise(0, ONE_MEGABIT);
    rig.accept_all(0);
    let frames = [standard(1, &[0xAA; 8]), standard(2, &[])];
    frames.iter().for_each(|frame| rig.hosts[0].send(*frame, Time::ZERO));
    rig.run(BIT * 20);
    rig.write(0, MCR, 0);
    rig.run(BIT * frame_bits(&frames[0]) - BIT * 21);
    assert_eq!(mode(&mut rig), INAK);
    rig.run(BIT);
    assert_eq!(mode(&mut rig), 0, "ACK delimiter, end of frame and intermission are eleven bits");
    rig.run(Time::from_millis(1));
    assert_eq!(rig.take(0, 0), Some((2, vec![])));
    assert_eq!(rig.take(0, 0), None);
}

#[test]
fn initialisation_waits_for_the_end_of_the_frame() {
    let mut rig = Rig::started(1, 1, 0);
    rig.request(0, 0, &standard(0x123, &[1]));
    rig.run(BIT * 10);
    rig.write(0, MCR, INRQ);
    assert_eq!(mode(&mut rig), 0);
    rig.run(Time::from_millis(1));
    assert_eq!(mode(&mut rig), INAK);
    assert!(rig.hosts[0].receive().is_some());
}

#[test]
fn bit_timing_can_be_written_in_initialisation_only() {
    let mut rig = Rig::started(1, 0, 0);
    rig.write(0, BTR, 0);
    assert_eq!(rig.read(0, BTR), ONE_MEGABIT);
}

#[test]
fn the_clock_makes_the_bit_rate() {
    let mut can = BxCan::new(false, 45_000_000);
    can.write(MCR, INRQ, Time::ZERO);
    can.write(BTR, 0x002B_0011, Time::ZERO);
    can.write(MCR, 0, Time::ZERO);
    let later = Time::from_millis(1);
    let bit = Time::of_cycle(45_000_000 / 18 / 16);
    let timing = BitTiming::new(bit, 12, 3, 1);
    assert_eq!(can.attachment(later), Attachment::Active { timing });
    can.set_clock(0);
    assert_eq!(can.attachment(later), Attachment::Off);
}

#[test]
fn a_sleeping_controller_detects_a_start_of_frame_and_wakes_on_command() {
    for (awum, stays) in [(0, SLAK), (AWUM, 0)] {
        let mut rig = Rig::new(1, 2);
        rig.initialise(0, ONE_MEGABIT);
        rig.accept_all(0);
        rig.write(0, IER, 1 << 16 | 1 << 17);
        rig.write(0, MCR, SLEEP | awum);
        assert_eq!(rig.read(0, MSR) & 0x1F, SLAK | 1 << 4);
        assert!(rig.chips[0].lines()[0].sce, "SLAKI");
        rig.write(0, MSR, 1 << 4);
        assert!(!rig.chips[0].lines()[0].sce);
        (1..=2).for_each(|id| rig.hosts[0].send(standard(id, &[]), rig.now));
        rig.run(Time::from_millis(1));
        assert_eq!(rig.read(0, MSR) & 0x1B, stays | 1 << 3);
        assert!(rig.chips[0].lines()[0].sce, "WKUI");
        assert_eq!(rig.take(0, 0).is_some(), awum != 0);
    }
}

#[test]
fn loop_back_needs_no_bus_and_silent_mode_does_not_acknowledge() {
    let mut rig = Rig::new(1, 1);
    rig.initialise(0, ONE_MEGABIT | LBKM);
    rig.accept_all(0);
    rig.write(0, MCR, 0);
    rig.run(BIT * 11);
    let frame = standard(0x321, &[1, 2, 3]);
    rig.request(0, 1, &frame);
    rig.run(BIT * (frame_bits(&frame) - 3) - Time(1));
    assert_eq!(rig.take(0, 0), None);
    rig.run(Time(1));
    assert_eq!(rig.take(0, 0), Some((0x321, vec![1, 2, 3])));
    assert_eq!(rig.read(0, TSR) & 0xFF00, 0x0300);
    assert_eq!(rig.hosts[0].receive(), None);

    rig.write(0, MCR, INRQ);
    rig.write(0, BTR, ONE_MEGABIT | SILM);
    rig.write(0, MCR, 0);
    rig.run(BIT * 11);
    rig.hosts[0].send(frame, rig.now);
    rig.request(0, 0, &frame);
    rig.run(BIT * 100);
    assert_eq!(rig.hosts[0].backlog(), 1);
    assert_eq!(rig.take(0, 0), None);
    assert_eq!(rig.read(0, TSR) & 0xFF, 0, "a silent controller sends nothing");
}

#[test]
fn alone_on_the_bus_the_controller_stays_error_passive() {
    let mut rig = Rig::started(1, 0, ABOM);
    rig.write(0, IER, 0xF << 8 | 1 << 15);
    rig.request(0, 0, &standard(0x700, &[0]));
    rig.run(Time::from_millis(100));
    assert_eq!(rig.read(0, ESR), 128 << 16 | 3 << 4 | 0b011);
    assert!(rig.chips[0].lines()[0].sce);
    rig.write(0, MSR, 1 << 2);
    rig.write(0, IER, 0x7 << 8 | 1 << 15);
    rig.run(Time::from_millis(10));
    assert!(!rig.chips[0].lines()[0].sce, "no condition is new");
    // Software may write LEC; the value stays until the next error.
    rig.write(0, ESR, 7 << 4);
    assert_eq!(rig.read(0, ESR) >> 4 & 7, 7);
    rig.hosts.push(HostNode::new(BIT));
    rig.run(Time::from_millis(1));
    assert_eq!(rig.read(0, ESR), 127 << 16 | 1);
}

/// A bit error in the data field makes every attempt of the chip fail.
fn fail_always(rig: &mut Rig) {
    for frame in 0..64 {
        rig.bus.faults.schedule(Fault { frame, position: Position::Bit(30), seen_by: SeenBy::Transmitters });
    }
}

#[test]
fn bus_off_after_32_failures_and_automatic_recovery() {
    let mut rig = Rig::started(1, 1, ABOM);
    fail_always(&mut rig);
    rig.write(0, IER, 1 << 10 | 1 << 15);
    rig.request(0, 0, &standard(0x100, &[0x55; 8]));
    while rig.read(0, ESR) & 4 == 0 {
        rig.run(BIT);
    }
    assert_eq!(rig.bus.frames(), 32);
    assert!(rig.chips[0].lines()[0].sce);
    let off = rig.now;
    while rig.read(0, ESR) & 4 != 0 {
        rig.run(BIT);
    }
    // The flag has just ended; the recessive bits begin with the delimiter.
    let bits = rig.now.since(off).0.div_ceil(BIT.0);
    assert!((128 * 11 - 1..=128 * 11).contains(&bits), "{bits}");
    assert_eq!(rig.read(0, ESR) & 0xFFFF_0007, 0);
    assert_eq!(rig.bus.frames(), 33, "the request is still there and the bus idle");
}

#[test]
fn bus_off_without_abom_waits_for_software() {
    let mut rig = Rig::started(1, 1, 0);
    fail_always(&mut rig);
    rig.request(0, 0, &standard(0x100, &[0x55; 8]));
    rig.run(Time::from_millis(50));
    assert_eq!(rig.read(0, ESR) & 4, 4);
    rig.write(0, MCR, INRQ);
    assert_eq!(mode(&mut rig), INAK);
    rig.run(Time::from_millis(50));
    rig.write(0, TSR, 1 << 7);
    rig.write(0, MCR, 0);
    rig.run(BIT * 11);
    assert_eq!(mode(&mut rig), 0);
    rig.run(BIT * (128 * 11 - 1));
    assert_eq!(rig.read(0, ESR) & 4, 4);
    rig.run(BIT);
    assert_eq!(rig.read(0, ESR) & 4, 0);
    rig.bus.faults = Faults::default();
    rig.request(0, 0, &standard(0x100, &[]));
    rig.run(Time::from_millis(1));
    assert!(rig.hosts[0].receive().is_some());
}

#[test]
fn a_master_reset_ends_in_sleep_and_keeps_the_configuration() {
    let mut rig = Rig::started(1, 1, ABOM);
    rig.hosts[0].send(standard(1, &[]), rig.now);
    rig.run(Time::from_millis(1));
    assert_eq!(rig.read(0, RF0R) & 3, 1);
    rig.write(0, MCR, 1 << 15);
    assert_eq!(rig.read(0, MCR), 0x0001_0002);
    assert_eq!((mode(&mut rig), rig.read(0, RF0R)), (SLAK, 0));
    assert_eq!((rig.read(0, BTR), rig.read(0, FA1R)), (ONE_MEGABIT, 1));
}

#[test]
fn a_reset_in_the_middle_of_a_frame_leaves_a_torso_on_the_wire() {
    let mut rig = Rig::started(1, 2, 0);
    rig.request(0, 0, &standard(0x100, &[1, 2, 3]));
    rig.run(BIT * 20);
    rig.chips[0].reset();
    rig.run(Time::from_millis(1));
    assert!(rig.hosts.iter_mut().all(|host| host.receive().is_none() && host.confinement().rec() == 1));
}
