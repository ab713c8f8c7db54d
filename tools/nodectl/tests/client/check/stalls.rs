//! Runs of the checks on a bus with stalls, as a simulator on a busy computer has them.

use canopen::{Duration, Frame, Instant};
use nodectl::Network;
use nodectl::bus::{Bus, BusError, Received};
use nodectl::check::{Profile, Run, Verdict};

use super::device::{ID, sheet};
use super::faulty::{Faulty, Look, Way};
use super::{complaints, judge_over};
use crate::wire::Wire;

/// A bus with stalls. During a stall, the clock of the computer continues.
struct Stalling {
    bus: Box<dyn Bus>,
    /// The time between two stalls, by the clock of the bus.
    every: Duration,
    length: Duration,
    next: Instant,
    /// The sum of the past stalls.
    past: Duration,
}

impl Stalling {
    /// Takes the present stall, if one is due.
    fn stall(&mut self) {
        if self.bus.now() >= self.next {
            self.past.0 += self.length.0;
            self.next = self.next + self.every;
        }
    }
}

impl Bus for Stalling {
    fn now(&self) -> Instant {
        self.bus.now() + self.past
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        loop {
            let there = Instant(until.0.saturating_sub(self.past.0));
            let received = self.bus.receive(there.min(self.next))?;
            self.stall();
            if received.is_some() || self.now() >= until {
                return Ok(received);
            }
        }
    }
}

/// A client on a bus with a device; the bus stalls each `every` milliseconds for `length` milliseconds.
fn network(device: Faulty, every: u64, length: u64) -> Network {
    let wire = Wire::new(device);
    let (every, length) = (Duration::from_millis(every), Duration::from_millis(length));
    Network::open(move || {
        let bus = Box::new(wire.clone());
        Ok(Box::new(Stalling { bus, every, length, next: Instant(0) + every, past: Duration(0) }))
    })
    .expect("an open bus")
}

fn healthy() -> Faulty {
    Faulty::new(Some(Profile::Measuring), Box::new(|_| ()))
}

/// A device that loses each second message of its event timer.
fn lossy() -> Faulty {
    let mut count = 0;
    let loses = move |look: &mut Look| {
        if look.is(Way::Out, 0x180 + u16::from(ID)) {
            count += 1;
            look.pass = look.pass.filter(|_| count % 2 == 0);
        }
    };
    Faulty::new(Some(Profile::Measuring), Box::new(loses))
}

fn judged(device: Faulty, every: u64, length: u64, only: &[&str]) -> Run {
    let profile = Some(Profile::Measuring);
    judge_over(&mut network(device, every, length), Some(sheet(profile)), profile, only)
}

#[test]
fn a_deviation_during_a_stall_is_not_the_devices() {
    for every in [2_500, 3_100] {
        let run = judged(healthy(), every, 400, &[]);
        assert_eq!(run.count("failed"), 0, "a stall each {every} ms: {}", complaints(&run).join("\n"));
    }
}

#[test]
fn a_fault_is_found_at_once_without_a_stall_and_in_spite_of_stalls() {
    let steady = judged(lossy(), 1_000_000, 1, &["PDO-21"]);
    let stalling = judged(lossy(), 300, 100, &["PDO-21"]);
    let [once, again] = [&steady, &stalling].map(|run| &run.results[0]);
    assert!(matches!(once.verdict, Verdict::Failed(_)), "{:?}", once.verdict);
    assert!(once.time < Duration::from_millis(2000), "one try: {:?}", once.time);
    let deviation = again.verdict.deviation().expect("the fault is found");
    let note = deviation.seen.split_once(", while ").map(|(_, note)| note);
    assert!(
        note.is_some_and(|note| note.starts_with("this computer or the bus stood still for ")),
        "{deviation:?}"
    );
}
