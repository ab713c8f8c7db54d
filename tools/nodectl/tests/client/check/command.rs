//! The command `check`: its output, its files and its exit code.

use std::path::PathBuf;

use super::device;
use super::faulty::Faulty;
use super::layers::{reads, swallows};
use crate::commands::{failed, printed, run};
use crate::wire::Wire;

/// A file for one test.
fn file(name: &str) -> PathBuf {
    std::env::temp_dir().join(format!("nodectl-check-{}-{name}", std::process::id()))
}

/// The data sheet of the device as a file.
fn sheet(name: &str) -> String {
    let mut text = String::new();
    let info = canopen::eds::DeviceInfo::new("Test", "a device");
    canopen::eds::write(device::table(None).0, &info, &mut text).expect("a string");
    let path = file(name);
    std::fs::write(&path, text).expect("a file");
    path.to_str().expect("text").to_owned()
}

fn good() -> Wire<Faulty> {
    Wire::new(Faulty::new(None, Box::new(|_| ())))
}

#[test]
fn a_conforming_device_passes_with_a_report() {
    let eds = sheet("good.eds");
    let table = printed(&good(), &["--node", "5", "--eds", &eds, "check", "--yes", "--only", "SDO-0,nmt-01"]);
    assert!(
        table.starts_with(
            "SDO: service data objects\n  SDO-01   passed       1000h is uploaded in one frame\n"
        ),
        "{table}"
    );
    assert!(table.contains("  NMT-01   passed       Reset node: "), "{table}");
    assert!(table.ends_with("\n10 passed, 0 failed, 0 recommended, 0 skipped\n"), "{table}");
}

#[test]
fn without_leave_nothing_is_restarted_or_saved() {
    let eds = sheet("leave.eds");
    let table = printed(&good(), &["--node", "5", "--eds", &eds, "check", "--only", "NMT-0,STO-20"]);
    assert!(table.contains("it restarts the device, which was not allowed (--yes)"), "{table}");
    assert!(table.contains("it writes the memory of the device, which was not allowed (--yes)"), "{table}");
    assert!(table.ends_with("\n0 passed, 0 failed, 0 recommended, 10 skipped\n"), "{table}");
}

#[test]
fn a_device_that_does_not_conform_is_9_and_the_reports_say_why() {
    let (eds, junit, html) = (sheet("wrong.eds"), file("junit.xml"), file("report.html"));
    let wire = Wire::new(Faulty::new(None, reads(0x1008, 0, b"<b>\x1b")));
    let files = ["--junit", junit.to_str().expect("text"), "--html", html.to_str().expect("text")];
    let line =
        [&["--node", "5", "--eds", &eds, "check", "--only", "DIC-10,DIC-11,ERR-01"][..], &files].concat();
    let (table, result) = run(&wire, &line);
    let failure = result.expect_err("a failure");
    assert_eq!((failure.exit_code(), failure.to_string().as_str()), (9, "1 check failed"));
    assert!(
        table.contains("CiA 306, 4.6.3\n") && table.contains("expected: the value of the data sheet\n"),
        "{table}"
    );
    assert!(table.contains("seen:     1008h:0: [3C, 62, 3E, 1B], not ["), "{table}");

    let xml = std::fs::read_to_string(&junit).expect("a report");
    assert!(xml.contains("tests=\"3\" failures=\"1\" errors=\"0\" skipped=\"0\""), "{xml}");
    assert!(
        xml.contains("605 [8] 40 08 10 00 00 00 00 00")
            && xml.contains("&lt;- 585 [8] 43 08 10 00 3C 62 3E 1B"),
        "{xml}"
    );
    let page = std::fs::read_to_string(&html).expect("a report");
    assert!(page.contains("<h3 id=\"DIC-10\" class=\"failed\">") && !page.contains("<b>"), "{page}");
    for path in [junit, html, eds.into()] {
        std::fs::remove_file(path).expect("a file");
    }
}

#[test]
fn scripts_get_one_value() {
    let eds = sheet("json.eds");
    let wire = Wire::new(Faulty::new(None, swallows(0x1000, 0)));
    let (line, result) =
        run(&wire, &["--json", "--node", "5", "--eds", &eds, "check", "--only", "SDO-03,SDO-04,NMT-01"]);
    let value: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!(result.expect_err("a failure").exit_code(), 9);
    let counts = ["passed", "failed", "recommended", "skipped"].map(|word| value[word].as_u64());
    assert_eq!(counts, [Some(1), Some(1), Some(0), Some(1)], "{line}");
    let check = &value["checks"][0];
    assert_eq!((&check["id"], &check["verdict"]), (&"SDO-03".into(), &"failed".into()));
    assert!(check["frames"].as_array().is_some_and(|frames| frames.len() > 2), "{line}");
}

#[test]
fn the_list_and_the_explanations_need_no_device() {
    let list = printed(&good(), &["check", "--list", "--profile", "404"]);
    assert!(
        list.starts_with(
            "EDS-01     The data sheet has the mandatory objects (CiA 301, 7.5.1; CiA 306, 4.6.3)\n"
        ),
        "{list}"
    );
    assert!(
        list.contains("\nNMT-01   r Reset node")
            && list.contains("\nSTO-20   s ")
            && list.contains("\nP404-07  "),
        "{list}"
    );
    let explained = printed(&good(), &["check", "--explain", "sdo-18"]);
    let expected = "SDO-18: An upload in one frame tells its size\nAbout: service data objects\n\
                    Rule: CiA 301, 7.2.4.3.6, which recommends this\nEffect: none that stays; what is written is written back\n";
    assert_eq!(explained, expected);
}

#[test]
fn unknown_checks_and_silent_nodes_are_reported() {
    assert_eq!(
        failed(&good(), &["check", "--only", "SDO-999"]),
        (2, "no check is called \"SDO-999\": see --list".to_owned())
    );
    assert_eq!(
        failed(&good(), &["check", "--explain", "x"]),
        (2, "no check is called \"x\": see --list".to_owned())
    );
    let (code, text) = failed(&good(), &["--node", "9", "check", "--only", "SDO-01"]);
    assert_eq!(code, 3, "{text}");
}

/// Values, mappings, saved values and the state are as before the run.
#[test]
fn a_whole_run_restores_the_device() {
    let (eds, wire) = (sheet("as-before.eds"), good());
    for line in [
        &["write", "1017", "700"][..],
        &["write", "2003", "77"],
        &["save"],
        &["write", "1007", "9"],
        &["nmt", "start"],
    ] {
        printed(&wire, &[&["--node", "5", "--eds", &eds], line].concat());
    }
    let dump = |name: &str| {
        let path = file(name);
        printed(&wire, &["--node", "5", "--eds", &eds, "dump", "--all", path.to_str().expect("text")]);
        let text = std::fs::read_to_string(&path).expect("a dump");
        std::fs::remove_file(path).expect("a file");
        text.lines()
            .filter(|line| !line.contains("Time") && !line.contains("FileName"))
            .collect::<Vec<&str>>()
            .join("\n")
    };
    let before = dump("before.dcf");
    printed(&wire, &["--node", "5", "--eds", &eds, "check", "--yes"]);
    assert_eq!(dump("after.dcf"), before);
    assert_eq!(wire.station(|station| station.state()), canopen::nmt::State::Operational);
    // The saved values are the same as before the run. Values that were not saved are lost with a restart.
    printed(&wire, &["--node", "5", "nmt", "reset"]);
    let values = printed(&wire, &["--node", "5", "--eds", &eds, "read", "1017", "2003", "1007"]);
    assert!(values.contains("= 700") && values.contains("= 77 ") && values.contains("= 0"), "{values}");
}
