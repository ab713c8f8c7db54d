//! A conformance test for any CANopen device: CiA 301, CiA 305 and the mandatory objects of some device profiles.
//!
//! A [`Check`] is one rule of a clause and a short function that tries the rule on a [`Subject`], the device on the bus. [`run`]
//! runs checks one after the other. Each begins in the state Pre-operational, with its own log of the bus, and what a check has
//! written is written back after it. A folder has the checks of one service.

mod dictionary;
mod emcy;
mod heartbeat;
mod lss;
mod nmt;
mod pdo;
mod profiles;
pub mod report;
mod robustness;
mod run;
mod sdo;
mod storage;
mod subject;
mod sync;
mod verdict;

pub use profiles::Profile;
pub use run::{Options, Result, Run, run};
pub use subject::{Setup, Subject};
pub use verdict::{Deviation, Outcome, Stop, Verdict};

use subject::prelude;

/// One rule that a device follows.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// Its name for good: `SDO-07`.
    pub id: &'static str,
    /// What a device that follows the rule does.
    pub title: &'static str,
    /// Where the rule is written.
    pub clause: &'static str,
    /// What the check does to the device beyond what is written back after it.
    pub effect: Effect,
    /// Whether the clause demands or only recommends.
    pub level: Level,
    /// Tries it.
    pub run: fn(&mut Subject<'_>) -> Outcome,
}

/// What a check does to the device, beyond what is written back after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effect {
    /// Nothing.
    None,
    /// Restarts the device or its communication: values that are not saved are lost, and written back after the run.
    Resets,
    /// Writes the memory of the device, by 1010h, 1011h or LSS.
    Stores,
}

/// How strict a clause is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// A device that does otherwise does not conform.
    Demanded,
    /// A device that does otherwise conforms.
    Recommended,
}

impl Check {
    /// A rule that is demanded, and that is tried without an effect.
    const fn new(
        id: &'static str,
        title: &'static str,
        clause: &'static str,
        run: fn(&mut Subject<'_>) -> Outcome,
    ) -> Check {
        Check { id, title, clause, effect: Effect::None, level: Level::Demanded, run }
    }

    /// The device is restarted.
    const fn resets(self) -> Check {
        Check { effect: Effect::Resets, ..self }
    }

    /// The memory of the device is written.
    const fn stores(self) -> Check {
        Check { effect: Effect::Stores, ..self }
    }

    /// The clause only recommends it.
    const fn recommended(self) -> Check {
        Check { level: Level::Recommended, ..self }
    }

    /// The group of the check: what is before the number in its name.
    #[must_use]
    pub fn group(&self) -> &'static str {
        self.id.split('-').next().unwrap_or_default()
    }

    /// Whether a person means this check: its name, the name of its group, or the beginning of either.
    #[must_use]
    pub fn is_meant(&self, text: &str) -> bool {
        !text.is_empty() && self.id.to_ascii_uppercase().starts_with(&text.to_ascii_uppercase())
    }
}

/// What the checks of a group are about.
#[must_use]
pub fn about(group: &str) -> &'static str {
    match group {
        "EDS" => "the electronic data sheet itself",
        "DIC" => "the dictionary against the data sheet",
        "SDO" => "service data objects",
        "NMT" => "network management and boot-up",
        "ERR" => "error control: heartbeat and node guarding",
        "EMC" => "emergencies",
        "SYN" => "synchronisation",
        "PDO" => "process data objects",
        "STO" => "saving and restoring parameters",
        "LSS" => "layer setting services",
        "ROB" => "robustness: foreign traffic, nonsense and floods",
        _ => "a device profile",
    }
}

/// The checks of CiA 301 and 305, in the order in which they are run, and those of a profile.
#[must_use]
pub fn all(profile: Option<Profile>) -> Vec<Check> {
    let groups: [&[&[Check]]; 11] = [
        dictionary::CHECKS,
        sdo::CHECKS,
        nmt::CHECKS,
        heartbeat::CHECKS,
        emcy::CHECKS,
        sync::CHECKS,
        pdo::CHECKS,
        storage::CHECKS,
        lss::CHECKS,
        robustness::CHECKS,
        profile.map_or(&[], Profile::checks),
    ];
    groups.into_iter().flatten().copied().flatten().copied().collect()
}
