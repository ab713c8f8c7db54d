//! The matrix of tests that are not about one personality, node-ID or bit rate.
//!
//! The usual run takes a few cases of each test, chosen by its name and a seed (variable `MATRIX_SEED`); with
//! `THOROUGH` it takes all. `MATRIX_LOG` names a file that gets a line for each case: `cargo xtask matrix` makes the
//! table of docs/evidence.md from it.

use std::fmt;
use std::io::Write as _;

use fastrand::Rng;
use node::Personality;

use crate::thorough::either;

/// Node-IDs of the cases: the smallest, the first one that the PDOs of a lift do not use, the largest.
const NODE_IDS: [u8; 3] = [1, 16, 127];
/// Bit rates of the cases in kbit/s.
const BIT_RATES: [u16; 3] = [10, 250, 1000];
/// Cases of a test in the usual run.
const SAMPLED: usize = 4;
/// The seed unless `MATRIX_SEED` is set.
const SEED: u64 = 1;

/// A case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Case {
    /// The personality of the node.
    pub personality: Personality,
    /// Its node-ID.
    pub node_id: u8,
    /// The bit rate in kbit/s.
    pub kbit: u16,
}

impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let name = self.personality.file_name().trim_end_matches(".eds");
        write!(f, "{name}, node {}, {} kbit/s", self.node_id, self.kbit)
    }
}

/// All cases.
pub fn all() -> impl Iterator<Item = Case> {
    let nodes = Personality::ALL.into_iter().flat_map(|personality| NODE_IDS.map(|id| (personality, id)));
    nodes.flat_map(|(personality, node_id)| BIT_RATES.map(|kbit| Case { personality, node_id, kbit }))
}

/// Runs a test in its cases: four in the usual run, one for each personality, and all of them with `THOROUGH`.
pub fn each(test: &str, run: impl Fn(Case)) {
    for case in cases(test) {
        // The output of a failed test ends with its case.
        println!("{test}: {case}");
        run(case);
        log(test, case);
    }
}

/// The cases of a test. Each personality is among them.
fn cases(test: &str) -> Vec<Case> {
    either(sampled(test), all().collect())
}

fn sampled(test: &str) -> Vec<Case> {
    let seed = std::env::var("MATRIX_SEED").ok().and_then(|seed| seed.parse().ok()).unwrap_or(SEED);
    // FNV-1a: the name of the test selects other cases than those of its neighbours.
    let hash = test.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3)
    });
    let mut rng = Rng::with_seed(seed ^ hash);
    (0..SAMPLED)
        .map(|number| Case {
            personality: Personality::ALL[number % Personality::ALL.len()],
            node_id: NODE_IDS[rng.usize(..NODE_IDS.len())],
            kbit: BIT_RATES[rng.usize(..BIT_RATES.len())],
        })
        .collect()
}

fn log(test: &str, case: Case) {
    let Some(path) = std::env::var_os("MATRIX_LOG") else { return };
    let Case { personality, node_id, kbit } = case;
    let name = personality.file_name().trim_end_matches(".eds");
    let line = format!("{test}\t{name}\t{node_id}\t{kbit}\n");
    let file = std::fs::OpenOptions::new().create(true).append(true).open(path);
    // The log is a by-product: a test does not fail for it.
    let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sample_has_every_personality_and_depends_on_the_name() {
        let [one, other] = ["save", "restore"].map(sampled);
        for cases in [&one, &other] {
            assert!(Personality::ALL.iter().all(|name| cases.iter().any(|case| case.personality == *name)));
        }
        assert_ne!(one, other);
        assert_eq!(one, sampled("save"));
        assert_eq!(all().count(), 36);
    }
}
