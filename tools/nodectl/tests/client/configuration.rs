//! The configuration of a node as a file: written, compared, applied.

use node::Personality;

use crate::commands::{failed, printed, run};
use crate::pressure::Pressure;
use crate::wire::Wire;

const PERSONALITIES: [Personality; 4] =
    [Personality::Pressure, Personality::Encoder, Personality::Combined, Personality::Lift];

fn path(name: &str) -> String {
    format!("{}/{name}", env!("CARGO_TARGET_TMPDIR"))
}

fn text(path: &str) -> String {
    std::fs::read_to_string(path).expect("a file")
}

/// Changes that a user makes in the field: a heartbeat, supervision, an event timer, a PDO with another mapping, a PDO
/// that is off, and the user's texts.
fn configure(wire: &Wire<Pressure>, personality: Personality) {
    let sheet = eds::DEVICES.iter().find(|device| device.personality == personality).expect("a sheet").eds();
    let carried = sheet.entries().filter(|entry| entry.is_tpdo_mappable()).last().expect("a process value");
    let object = format!("{:04X}:{}", carried.index, carried.sub);
    let at_5 = |line: &[&'static str]| [line, &["-n", "5"]].concat();
    let map = |pdo: &'static str| {
        let line = ["map", "tpdo", pdo, &object, "--transmission", "10", "-n", "5"];
        printed(wire, &line);
    };
    for line in [
        &["write", "1017", "500"][..],
        &["write", "1016:1", "0x000205DC"],
        &["write", "1029:1", "1"],
        &["write", "1015", "200"],
    ] {
        printed(wire, &at_5(line));
    }
    if personality == Personality::Lift {
        // The pre-defined PDOs of a lift have a fixed mapping.
        printed(wire, &at_5(&["write", "1881:5", "250"]));
        return;
    }
    map("3");
    printed(wire, &at_5(&["write", "1801:5", "250"]));
    printed(wire, &at_5(&["unmap", "tpdo", "2"]));
}

#[test]
fn dump_apply_dump_is_the_same_for_every_personality() {
    for personality in PERSONALITIES {
        let (first, second) =
            (path(&format!("{personality:?}-1.dcf")), path(&format!("{personality:?}-2.dcf")));
        let wire = Wire::new(Pressure::of(personality, 5));
        printed(&wire, &["dump", &second, "-n", "5"]);
        let factory = text(&second);
        configure(&wire, personality);
        printed(&wire, &["dump", &first, "-n", "5"]);
        assert_ne!(text(&first).replace("-1.dcf", ""), factory.replace("-2.dcf", ""));
        let fresh = Wire::new(Pressure::of(personality, 5));
        let (differences, result) = run(&fresh, &["diff", &first, "-n", "5"]);
        assert_eq!(result.unwrap_err().exit_code(), 8, "{personality:?}");
        let changes = printed(&fresh, &["apply", &first, "-n", "5", "--dry-run"]);
        assert!(changes.lines().count() >= 5, "{changes}");
        assert_eq!(changes.lines().count(), differences.lines().count(), "{changes}{differences}");
        assert_eq!(failed(&fresh, &["diff", &first, "-n", "5"]).0, 8, "a dry run changes nothing");
        let done = printed(&fresh, &["apply", &first, "-n", "5", "--save"]);
        assert!(done.contains("changes, read back, saved"), "{done}");
        assert_eq!(printed(&fresh, &["diff", &first, "-n", "5"]), "");
        printed(&fresh, &["dump", &second, "-n", "5"]);
        assert_eq!(
            text(&first).replace("-1.dcf", ""),
            text(&second).replace("-2.dcf", ""),
            "{personality:?}"
        );
        // The configuration survives a reset. Applying it again writes nothing.
        printed(&fresh, &["nmt", "reset", "-n", "5"]);
        assert_eq!(printed(&fresh, &["apply", &first, "-n", "5"]), "node 5: has it already\n");
    }
}

#[test]
fn files_are_compared_with_each_other() {
    let (sheet, dump) = ("../../eds/pressure.eds", path("compared.dcf"));
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["dump", &dump]);
    assert_eq!(printed(&wire, &["diff", sheet, &dump]), "", "as it comes from the factory");
    printed(&wire, &["write", "1017", "250"]);
    printed(&wire, &["dump", &dump]);
    let (lines, result) = run(&wire, &["diff", sheet, &dump]);
    assert_eq!(lines, "1017h:0 Producer heartbeat time: 1000 -> 250\n");
    assert_eq!(result.unwrap_err().to_string(), "1 parameter differs");
}

#[test]
fn a_file_for_another_product_changes_nothing() {
    let wire = Wire::new(Pressure::new(1));
    let (code, text) = failed(&wire, &["apply", "../../eds/encoder.eds"]);
    assert_eq!((code, text.contains("product 00000002h")), (7, true), "{text}");
}

/// A product code is unique only together with the vendor-ID (CiA 301, 7.5.2.14).
#[test]
fn a_file_for_a_product_of_another_vendor_changes_nothing() {
    let wire = Wire::new(Pressure::new(1));
    let file = path("vendor.dcf");
    printed(&wire, &["write", "1017", "777"]);
    printed(&wire, &["dump", &file]);
    printed(&wire, &["write", "1017", "1000"]);
    let own = text(&file);
    let (before, after) = own.split_once("VendorNumber=").expect("a vendor");
    let after = after.split_once('\r').expect("a line").1;
    std::fs::write(&file, format!("{before}VendorNumber=0x3E7\r{after}")).expect("a file");
    for line in [&["apply", &file][..], &["apply", &file, "--dry-run"]] {
        let (code, text) = failed(&wire, line);
        assert_eq!((code, text.contains("vendor 000003E7h")), (7, true), "{text}");
    }
    assert!(printed(&wire, &["read", "1017"]).contains("= 1000 ms"), "nothing was written");
    assert_eq!(printed(&wire, &["apply", &file, "--force"]), "node 1: 1 change, read back\n");
}

/// A file that is cut, or that has a value which its object cannot have, is refused as a whole.
#[test]
fn a_damaged_file_is_not_applied() {
    let wire = Wire::new(Pressure::new(1));
    printed(&wire, &["write", "1017", "250"]);
    let file = path("damaged.dcf");
    printed(&wire, &["dump", "--all", &file]);
    let whole = text(&file);
    printed(&wire, &["write", "1017", "1000"]);
    let cut = whole.split_once("[6124]").expect("6124h").0.to_owned();
    let wrong = whole.replace("ParameterValue=250\r\n", "ParameterValue=-5\r\n");
    let expected = "[1017] ParameterValue: \"-5\" is not a value of UNSIGNED16, 0 to 65535, and is not read";
    for (damaged, words) in [(cut, "6124h is listed and has no section"), (wrong, expected)] {
        std::fs::write(&file, &damaged).expect("a file");
        for line in [&["apply", &file][..], &["apply", &file, "--dry-run"]] {
            let (code, text) = failed(&wire, line);
            assert_eq!((code, text.contains(words)), (7, true), "{text}");
        }
        assert!(printed(&wire, &["read", "1017"]).contains("= 1000 ms"), "nothing was written");
    }
    // By force, the rest is written.
    printed(&wire, &["write", "1015", "300"]);
    printed(&wire, &["apply", &file, "--force"]);
    assert!(printed(&wire, &["read", "1015"]).contains("= 0 "));
}

/// A PDO is changed in five steps, and the user has changed three objects.
#[test]
fn a_dry_run_shows_each_changed_object_once() {
    let (wire, fresh) = (Wire::new(Pressure::new(1)), Wire::new(Pressure::new(1)));
    let file = path("dry.dcf");
    printed(&wire, &["map", "tpdo", "1", "7130:1", "--transmission", "1"]);
    printed(&wire, &["dump", &file]);
    assert_eq!(
        printed(&fresh, &["apply", &file, "--dry-run"]),
        "1800h:2 TPDO 1 communication parameter/Transmission type: 255 -> 1\n\
         1A00h:0 TPDO 1 mapping parameter/Number of entries: 2 -> 1\n\
         1A00h:1 TPDO 1 mapping parameter/Mapped object 1: 1630535968 (61300120h) -> 1898971408 (71300110h)\n"
    );
    assert_eq!(printed(&fresh, &["apply", &file]), "node 1: 3 changes, read back\n");
}

/// The error names the entry of a mapping that the node refuses, not the steps that lead to it.
#[test]
fn only_end_values_are_reported_as_different() {
    let wire = Wire::new(Pressure::new(1));
    let file = path("mapping.dcf");
    printed(&wire, &["dump", "--all", &file]);
    let (before, after) = {
        let all = text(&file);
        let (before, after) = all.split_once("[1A00sub1]").expect("1A00h:1");
        (before.to_owned(), after.to_owned())
    };
    let (value, rest) = after.split_once("ParameterValue=").expect("a value");
    let rest = rest.split_once('\r').expect("a line").1;
    std::fs::write(&file, format!("{before}[1A00sub1]{value}ParameterValue=0x10180120\r{rest}"))
        .expect("a file");
    let (code, text) = failed(&wire, &["apply", &file]);
    assert_eq!(code, 1, "{text}");
    assert!(text.contains("1A00h:1 is ") && text.contains(" instead of 270008608 "), "{text}");
    assert!(!text.contains("1800h:1") && !text.contains("1A00h:0"), "{text}");
}

#[test]
fn a_file_has_the_known_bit_rate() {
    let wire = Wire::new(Pressure::new(1));
    assert!(!printed(&wire, &["dump"]).contains("Baudrate="));
    assert!(printed(&wire, &["dump", "--bit-rate", "125"]).contains("\nBaudrate=125\r\n"));
    assert!(printed(&wire, &["--bus", "slcan:/dev/ttyACM0", "dump"]).contains("\nBaudrate=250\r\n"));
}

#[test]
fn a_mapping_is_made_in_one_command() {
    let wire = Wire::new(Pressure::new(1));
    let line = printed(
        &wire,
        &["map", "tpdo", "1", "7130:1", "7130:2", "AI status pressure", "--transmission", "1"],
    );
    assert_eq!(line, "node 1: TPDO 1 (181h) has 3 objects, 40 bits\n");
    let lines = printed(&wire, &["read", "1A00:0", "1A00:1", "1A00:2", "1A00:3", "1800:1", "1800:2"]);
    for expected in ["= 3\n", "(71300110h)", "(71300210h)", "(61500108h)", "(00000181h)", "= 1\n"] {
        assert!(lines.contains(expected), "{expected}: {lines}");
    }
    assert_eq!(printed(&wire, &["unmap", "tpdo", "1"]), "node 1: TPDO 1 is off and empty\n");
    // A refused mapping leaves the PDO on.
    printed(&wire, &["map", "tpdo", "1", "6130:1"]);
    assert_eq!(failed(&wire, &["map", "tpdo", "1", "1017"]).0, 2);
    assert_eq!(failed(&wire, &["map", "tpdo", "1", "6130:1", "--transmission", "245"]).0, 1);
    assert!(printed(&wire, &["read", "1800:1"]).contains("(00000181h)"));
    assert_eq!(failed(&wire, &["map", "tpdo", "1", "6130:1", "6130:2", "6150:1"]).0, 2);
    assert_eq!(failed(&wire, &["map", "tpdo", "99", "1001"]).0, 2);
    assert_eq!(failed(&wire, &["map", "tpdo", "1", "1008"]).0, 2);
}

#[test]
fn objects_are_listed_with_their_data_sheet() {
    let wire = Wire::new(Pressure::new(1));
    let lines = printed(&wire, &["list", "heartbeat"]);
    assert!(lines.contains("1017h:0   rw    UNSIGNED16"), "{lines}");
    assert!(lines.contains("Producer heartbeat time = 1000 ms"), "{lines}");
    assert!(printed(&wire, &["list", "1019"]).contains("(0 to 240)"));
    assert!(printed(&wire, &["list", "--no-values"]).lines().count() > 350);
    assert_eq!(failed(&wire, &["list", "no such thing"]).0, 2);
    let line = printed(&wire, &["--json", "list", "1017"]);
    let value: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!((value["value"].as_u64(), value["access"].as_str()), (Some(1000), Some("rw")));
}
