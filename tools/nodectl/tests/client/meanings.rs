//! Tests of scaled values: units, decimal digits, words. Also of hints in error messages.

use canopen::{Duration, NodeId};
use node::Personality;
use nodectl::Catalogue;
use nodectl::acquisition::{Acquisition, Setup};
use nodectl::sdo::Options;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::wire::Wire;

fn json(line: &str) -> serde_json::Value {
    serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}"))
}

/// 6132h is the position of the decimal point: 250 with two digits is 2.50 bar and not 250.
#[test]
fn an_integer_with_a_unit_has_its_point() {
    for (personality, first) in [(Personality::Pressure, 0x6000_u16), (Personality::Combined, 0x6800)] {
        let wire = Wire::new(Pressure::of(personality, 1));
        let object = |index: u16| format!("{:04X}:1", index - 0x6000 + first);
        printed(&wire, &["write", &object(0x6132), "2"]);
        let line = printed(&wire, &["write", &object(0x7148), "2.5"]);
        assert!(line.ends_with("= 2.50 bar\n"), "{line}");
        // A number with a decimal point is the scaled value.
        let line = printed(&wire, &["write", &object(0x7148), "-1.5"]);
        assert!(line.ends_with("= -1.50 bar\n"), "{line}");
        let value = json(&printed(&wire, &["--json", "read", &object(0x7148)]));
        assert_eq!((value["value"].as_f64(), value["raw"].as_i64()), (Some(-1.5), Some(-150)));
        assert_eq!(failed(&wire, &["write", &object(0x7148), "1.234"]).0, 2);
        // The object 9149h is an INTEGER32. A REAL32 below has no decimal digits.
        let line = printed(&wire, &["read", &object(0x9149)]);
        assert!(line.ends_with("= 21474836.47 bar\n"), "{line}");
        assert!(printed(&wire, &["read", &object(0x6149)]).ends_with("= 10 bar\n"));
        let (object, csv) = (object(0x7148), format!("{}/digits.csv", env!("CARGO_TARGET_TMPDIR")));
        assert!(printed(&wire, &["monitor", "--count", "1", &object]).contains("= -1.50 bar"));
        printed(&wire, &["record", "--for", "0.3", "--csv", &csv, &object]);
        assert!(std::fs::read_to_string(&csv).expect("a table").contains(",-1.50\n"));
    }
}

/// 6384h:1 is the measuring step of positions. So the unit of a position is a length.
#[test]
fn a_position_of_a_lift_is_a_length() {
    let wire = Wire::new(Pressure::of(Personality::Lift, 1));
    printed(&wire, &["write", "2302:2", "1234"]);
    assert!(printed(&wire, &["read", "2302:2"]).ends_with("= 1234 mm\n"));
    printed(&wire, &["write", "6384:1", "--raw", "50"]);
    assert!(printed(&wire, &["write", "2302:2", "617.5"]).ends_with("= 617.5 mm\n"));
}

#[test]
fn numbers_that_stand_for_something_say_it() {
    let wire = Wire::new(Pressure::new(1));
    let line = printed(&wire, &["read", "6131:1"]);
    assert!(line.ends_with("= 5111808 (004E0000h) [bar]\n"), "{line}");
    assert_eq!(json(&printed(&wire, &["--json", "read", "6131:1"]))["meaning"], "bar");
    assert!(printed(&wire, &["read", "6150:1"]).contains("valid]"));
}

#[test]
fn a_record_is_read_as_a_whole() {
    let wire = Wire::new(Pressure::new(1));
    let lines = printed(&wire, &["read", "1018"]);
    let objects: Vec<&str> = lines.lines().filter_map(|line| line.split(' ').next()).collect();
    assert_eq!(objects, ["1018h:0", "1018h:1", "1018h:2", "1018h:3", "1018h:4"]);
    assert_eq!(printed(&wire, &["read", "identity"]), lines);
    assert_eq!(printed(&wire, &["read", "1018:0"]).lines().count(), 1);
    assert_eq!(printed(&wire, &["read", "1017"]).lines().count(), 1);
}

#[test]
fn one_object_that_cannot_be_read_does_not_keep_the_others_from_it() {
    let wire = Wire::new(Pressure::new(1));
    let (lines, result) = run(&wire, &["read", "1017", "5FFF", "1018:4"]);
    let failure = result.unwrap_err();
    assert_eq!((failure.exit_code(), failure.to_string().as_str()), (1, "1 of 3 objects could not be read"));
    assert_eq!(lines.lines().count(), 2, "{lines}");
    let (lines, _) = run(&wire, &["--json", "read", "1017", "5FFF", "1018:4"]);
    let error = json(lines.lines().nth(1).expect("a line"));
    assert_eq!((error["object"].as_str(), error["exit_code"].as_i64()), (Some("5FFFh:0"), Some(1)));
    assert_eq!(error["abort"].as_u64(), Some(0x0602_0000));
}

/// All commands give values the same keys as `read`.
#[test]
fn values_have_one_schema() {
    let wire = Wire::new(Pressure::new(1));
    let read = json(&printed(&wire, &["--json", "read", "1017"]));
    let write = json(&printed(&wire, &["--json", "write", "1017", "1000"]));
    let mut monitor = json(&printed(&wire, &["--json", "monitor", "1017", "--count", "1"]));
    assert!(monitor["time"].is_number());
    monitor.as_object_mut().expect("an object").remove("time");
    assert_eq!((&write, &monitor), (&read, &read));
}

#[test]
fn names_are_found_by_words_and_near_misses_are_suggested() {
    let wire = Wire::new(Pressure::new(1));
    assert!(printed(&wire, &["read", "heartbeat producer"]).starts_with("1017h:0 "));
    let (code, text) = failed(&wire, &["read", "heartbet"]);
    assert_eq!((code, text.contains("Producer heartbeat time")), (2, true), "{text}");
}

#[test]
fn a_refusal_has_a_hint() {
    let wire = Wire::new(Pressure::new(1));
    assert!(failed(&wire, &["write", "1019", "250"]).1.ends_with("value too high; it takes 0 to 240"));
    let (_, text) = failed(&wire, &["write", "1A00:0", "3"]);
    assert!(text.contains("switched off (bit 31 of 1800h:1)"), "{text}");
    assert!(failed(&wire, &["save", "manufacturer"]).1.contains("no such group"));
    printed(&wire, &["nmt", "stop"]);
    let (code, text) = failed(&wire, &["read", "1000"]);
    assert_eq!((code, text.contains("the node is stopped")), (3, true), "{text}");
    let file = format!("{}/elf", env!("CARGO_TARGET_TMPDIR"));
    std::fs::write(&file, b"\x7fELF and more").expect("a file");
    assert!(failed(&wire, &["update", &file]).1.contains("firmware.img"));
}

/// An inhibit time has a unit of 100 us (1015h, 1800h:3).
#[test]
fn an_inhibit_time_is_shown_in_milliseconds_too() {
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["write", "1015", "100"]);
    assert_eq!(
        printed(&wire, &["read", "1015"]).trim_end(),
        "1015h:0 Inhibit time EMCY = 100 x 100 us (10 ms)"
    );
    let value = json(&printed(&wire, &["--json", "read", "1015"]));
    assert_eq!((value["value"].as_i64(), value["unit"].as_str()), (Some(100), Some("100 us")));
}

#[test]
fn an_acquisition_names_its_missing_tpdos_until_a_value_arrives() {
    let wire = Wire::new(Pressure::new(1));
    let mut network = wire.network();
    let catalogue = Catalogue::of_file("pressure.eds").expect("a data sheet");
    let setup = Setup {
        node: NodeId::new(1).expect("a node-ID"),
        options: Options::default(),
        period: Duration::from_millis(100),
        start: false,
    };
    let mut acquisition =
        Acquisition::open(&mut network, setup, &std::sync::Arc::new(catalogue), &[]).expect("an acquisition");
    let waits = "waiting for TPDO 1 (181h) of node 1";
    assert_eq!(acquisition.awaited().as_deref(), Some(waits));
    let until = acquisition.now() + Duration::from_millis(3000);
    assert!(acquisition.next(until).expect("a bus").is_none(), "the node is not Operational");
    assert_eq!(acquisition.awaited().as_deref(), Some(waits));
}
