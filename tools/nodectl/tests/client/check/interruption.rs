//! Runs that Ctrl-C ends: the device has its values, its saved values and its state again, wherever the run was.

use std::cell::Cell;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::Frame;
use canopen::nmt::State;
use nodectl::check::{self, Effect, Run, Setup, Subject};

use super::device;
use super::faulty::Faulty;
use crate::commands::printed;
use crate::wire::{Fate, Wire};

/// The object, the saved value and the value that is not saved.
const VALUES: [(&str, u32, u32); 3] = [("1017", 700, 800), ("2003", 77, 78), ("1800:5", 90, 95)];

/// A device with saved and other values, in Operational.
fn configured() -> Wire<Faulty> {
    let wire = Wire::new(Faulty::new(None, Box::new(|_| ())));
    for (object, saved, _) in VALUES {
        printed(&wire, &["--node", "5", "write", object, &saved.to_string(), "--type", kind(object)]);
    }
    printed(&wire, &["--node", "5", "save"]);
    for (object, _, value) in VALUES {
        printed(&wire, &["--node", "5", "write", object, &value.to_string(), "--type", kind(object)]);
    }
    printed(&wire, &["--node", "5", "nmt", "start"]);
    wire
}

fn kind(object: &str) -> &'static str {
    if object == "2003" { "u32" } else { "u16" }
}

fn value(wire: &Wire<Faulty>, object: &str) -> u32 {
    let line = printed(wire, &["--node", "5", "--json", "read", object, "--type", kind(object)]);
    let line: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    line["value"].as_u64().and_then(|value| value.try_into().ok()).expect("a number")
}

/// A run that is interrupted at its frame number `at`, in either direction.
fn interrupted_at(wire: &Wire<Faulty>, at: usize, only: &[&str]) -> Run {
    let (stop, count) = (Arc::new(AtomicBool::new(false)), Rc::new(Cell::new(0)));
    let set = Arc::clone(&stop);
    wire.disturb(move |_| {
        count.set(count.get() + 1);
        if count.get() == at {
            set.store(true, Ordering::Relaxed);
        }
        Fate::Arrives
    });
    run_until(wire, stop, only, Some(device::sheet(None)))
}

/// A run that ends when the flag is set.
fn run_until(wire: &Wire<Faulty>, stop: Arc<AtomicBool>, only: &[&str], sheet: Option<eds::Eds>) -> Run {
    let setup = Setup {
        node: canopen::NodeId::new(device::ID).expect("a node-ID"),
        sheet,
        timeout: canopen::Duration::from_millis(500),
        boot: canopen::Duration::from_millis(2000),
    };
    let mut checks = check::all(None);
    checks.retain(|check| only.iter().any(|text| check.is_meant(text)));
    let mut network = wire.network();
    let mut subject =
        Subject::new(&mut network, setup).with_interruption(move || stop.load(Ordering::Relaxed));
    let options = check::Options { checks, allowed: Effect::Stores };
    check::run(&mut subject, &options, |_| ()).unwrap_or_else(|stop| panic!("{stop:?}"))
}

/// Interrupts runs of these checks at every `step`th frame, up to the end of a whole run.
fn restores(only: &[&str], step: usize) {
    for at in (1..).step_by(step) {
        let wire = configured();
        let run = interrupted_at(&wire, at, only);
        wire.disturb(|_| Fate::Arrives);
        let place = format!("{only:?}, frame {at}, after {} checks", run.results.len());
        assert!(run.left_behind.is_empty(), "{place}: {:?}", run.left_behind);
        assert_eq!(run.count("failed"), 0, "{place}");
        assert_eq!(wire.station(|station| station.state()), State::Operational, "{place}");
        for (object, _, present) in VALUES {
            assert_eq!(value(&wire, object), present, "{place}: {object}");
        }
        printed(&wire, &["--node", "5", "nmt", "reset"]);
        for (object, saved, _) in VALUES {
            assert_eq!(value(&wire, object), saved, "{place}: {object} after a reset");
        }
        if !run.is_interrupted {
            return;
        }
    }
}

#[test]
fn an_interrupted_run_restores_the_saved_values() {
    restores(&["STO"], 211);
    restores(&["STO-20", "STO-40"], 23);
}

#[test]
fn an_interrupted_run_restores_values_and_the_nmt_state() {
    restores(&["PDO"], 997);
    restores(&["SDO"], 307);
    restores(&["ERR", "EMC", "SYN"], 409);
    restores(&["NMT", "LSS"], 211);
}

#[test]
fn the_checks_after_an_interruption_are_skipped() {
    const ONLY: &[&str] = &["SDO-01", "SDO-02", "SDO-03"];
    let whole = interrupted_at(&configured(), usize::MAX, ONLY);
    assert_eq!((whole.count("passed"), whole.is_interrupted), (3, false));
    let none = interrupted_at(&configured(), 1, ONLY);
    assert_eq!((none.count("skipped"), none.is_interrupted), (3, true));
}

/// Without a data sheet, only the check knows what it has written.
#[test]
fn a_value_that_an_interrupted_check_cannot_restore_is_reported() {
    let wire = configured();
    let stop = Arc::new(AtomicBool::new(false));
    let set = Arc::clone(&stop);
    wire.disturb(move |frame| {
        // The write of 1017h by the check arrives; the one that restores it becomes another write.
        let is_write = frame.id() == 0x605 && frame.data().starts_with(&[0x2B, 0x17, 0x10]);
        if !is_write || !set.swap(true, Ordering::Relaxed) {
            return Fate::Arrives;
        }
        Fate::BecomesAnother(Frame::new(0x605, &[0x2B, 0x17, 0x10, 0, 9, 0, 0, 0]).expect("a frame"))
    });
    let run = run_until(&wire, stop, &["ERR-0"], None);
    assert!(run.is_interrupted);
    assert!(run.left_behind.iter().any(|left| left.contains("1017h:0")), "{:?}", run.left_behind);
}
