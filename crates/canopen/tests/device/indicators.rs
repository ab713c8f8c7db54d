//! The indicators RUN and ERROR (CiA 303-3): the NMT state, and the worst of several errors.

use crate::bench::Bench;
use canopen::indicators::BusHealth::{Good, Off, Searching, Warning};
use canopen::indicators::Pattern::{self, Blinking, Flashes, Flickering, On};
use canopen::indicators::{BusHealth, Indicators};
use canopen::lss::Request;
use canopen::{Duration, Frame, Instant};

fn patterns(bench: &Bench, bus: BusHealth) -> (Pattern, Pattern) {
    let Indicators { run, error } = bench.device.indicators(bus);
    (run, error)
}

#[test]
fn run_shows_the_nmt_state() {
    assert_eq!(patterns(&Bench::unstarted(), Good), (Pattern::Off, Pattern::Off));
    let mut bench = Bench::booted();
    assert_eq!(patterns(&bench, Good), (Blinking, Pattern::Off));
    for (command, run) in [(1, On), (2, Flashes(1)), (128, Blinking)] {
        bench.nmt(command);
        assert_eq!(patterns(&bench, Good), (run, Pattern::Off), "command {command}");
    }
}

#[test]
fn both_flicker_while_the_bit_rate_or_the_node_is_configured() {
    let mut bench = Bench::operational();
    assert_eq!(patterns(&bench, Searching), (Flickering, Flickering));
    let request = Request::SwitchGlobal { configuration: true };
    bench.nmt(2);
    bench.receive(Frame::new(0x7E5, &request.encode()).unwrap());
    assert_eq!(patterns(&bench, Warning), (Flickering, Flickering));
    assert_eq!(patterns(&bench, Off), (Flickering, On), "bus-off is the worst error");
}

/// Each error comes in addition to the others, the lightest first.
#[test]
fn error_shows_the_worst_of_several_errors() {
    let mut bench = Bench::booted();
    bench.write(0x1029, 1, &[1]).unwrap();
    bench.write32(0x1800, 1, 0x8000_0185).unwrap();
    bench.write32(0x1600, 1, 0x6200_0010).unwrap();
    bench.write(0x1600, 0, &[1]).unwrap();
    bench.write32(0x1400, 1, 0x205).unwrap();
    bench.write(0x1400, 5, &[10, 0]).unwrap();
    bench.nmt(1);
    assert_eq!(patterns(&bench, Good), (On, Pattern::Off));
    assert_eq!(patterns(&bench, Warning), (On, Flashes(1)));
    // Node 9 has sent one heartbeat.
    bench.write32(0x1016, 1, 0x0009_000A).unwrap();
    bench.receive(Frame::new(0x709, &[5]).unwrap());
    assert_eq!(patterns(&bench, Good), (On, Pattern::Off));
    bench.run(Duration::from_millis(11));
    assert_eq!(patterns(&bench, Warning), (On, Flashes(2)));
    // One SYNC has come.
    bench.write32(0x1006, 0, 10_000).unwrap();
    bench.sync();
    bench.run(Duration::from_millis(16));
    assert_eq!(patterns(&bench, Warning), (On, Flashes(3)));
    // RPDO 1 has come once.
    bench.receive(Frame::new(0x205, &[1, 2]).unwrap());
    bench.run(Duration::from_millis(11));
    assert_eq!(patterns(&bench, Warning), (On, Flashes(4)));
    assert_eq!(patterns(&bench, Off), (On, On));
    // All of them are back.
    bench.receive(Frame::new(0x205, &[1, 2]).unwrap());
    assert_eq!(patterns(&bench, Good), (On, Flashes(3)));
    bench.sync();
    assert_eq!(patterns(&bench, Good), (On, Flashes(2)));
    bench.receive(Frame::new(0x709, &[5]).unwrap());
    assert_eq!(patterns(&bench, Good), (On, Pattern::Off));
}

#[test]
fn damaged_stored_values_blink_unless_the_bus_has_an_error() {
    let mut bench = Bench::unstarted();
    bench.device.application_mut().is_damaged = true;
    bench.start();
    assert_eq!(patterns(&bench, Good).1, Blinking);
    assert_eq!(patterns(&bench, Warning).1, Flashes(1));
}

#[test]
fn the_end_of_the_time_has_no_next_change() {
    assert_eq!(Indicators::next_change(Instant::NEVER), Instant::NEVER);
    let both = Indicators { run: Pattern::Flickering, error: Pattern::Flickering };
    let [run, error] = both.levels(Instant::NEVER);
    assert_ne!(run, error);
}
