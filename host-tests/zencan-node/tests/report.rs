//! The report of `nodectl check` for zencan-node 0.0.5, a device from another project. docs/check.md explains each
//! line.

use canopen::{Duration, NodeId};
use nodectl::Network;
use nodectl::bus::{Bus, Simulated};
use nodectl::check::{self, Effect, Run, Setup, Subject};
use zencan_device::{ID, Zencan};

/// The failing checks, grouped by cause.
const FAULTS: [(&str, &[&str]); 9] = [
    ("the boot-up message says 7Fh", &["NMT-01", "NMT-02", "NMT-03", "NMT-04", "NMT-05", "NMT-06"]),
    ("SDO is served in Stopped", &["NMT-28"]),
    ("the heartbeat time cannot be written", &["ERR-01"]),
    ("an unknown SDO command is not answered, and an abort is", &["SDO-09", "SDO-17"]),
    ("block sizes and sequence numbers are not checked", &["SDO-68", "SDO-69", "SDO-70"]),
    (
        "a PDO takes restricted CAN-IDs, and another one while it is valid",
        &["PDO-05", "PDO-06", "PDO-07", "PDO-08"],
    ),
    (
        "a PDO takes reserved types, and maps what it cannot carry",
        &["PDO-10", "PDO-11", "PDO-66", "PDO-70", "PDO-73"],
    ),
    ("a remote frame is not answered although bit 30 of the COB-ID is 0", &["PDO-20"]),
    (
        "1010h:0 cannot be read, and LSS takes any node-ID",
        &["STO-01", "STO-03", "STO-05", "LSS-20", "LSS-21", "LSS-23"],
    ),
];

fn ids(run: &Run, word: &str) -> Vec<&'static str> {
    let told = run.results.iter().filter(|result| result.verdict.word() == word);
    let mut ids: Vec<&str> = told.map(|result| result.check.id).collect();
    ids.sort_unstable();
    ids
}

#[test]
fn its_faults_are_found() {
    let open = || Ok(Box::new(Simulated::new(Zencan::new())) as Box<dyn Bus>);
    let mut network = Network::open(open).expect("a bus");
    let setup = Setup {
        node: NodeId::new(ID).expect("a node-ID"),
        sheet: None,
        timeout: Duration::from_millis(300),
        boot: Duration::from_millis(5000),
    };
    let options = check::Options { checks: check::all(None), allowed: Effect::Stores };
    let run = check::run(&mut Subject::new(&mut network, setup), &options, |_| ()).expect("an answer");
    let mut expected: Vec<&str> = FAULTS.iter().flat_map(|(_, ids)| *ids).copied().collect();
    expected.sort_unstable();
    let verdicts: Vec<String> =
        run.results.iter().map(|result| format!("{} {:?}", result.check.id, result.verdict)).collect();
    assert_eq!(ids(&run, "failed"), expected, "{}", verdicts.join("\n"));
    assert_eq!(ids(&run, "recommended"), ["LSS-12", "LSS-28", "NMT-12", "NMT-44", "SDO-46"]);
    assert!(run.count("passed") > 120, "{}", verdicts.join("\n"));
}
