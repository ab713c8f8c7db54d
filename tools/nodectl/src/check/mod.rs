//! A conformance test for any CANopen device: CiA 301, CiA 305 and the mandatory objects of some device profiles.
//!
//! A [`Check`] is one rule of a clause, with a short function that tries the rule on a [`Subject`], the device on the
//! bus. [`run`] runs checks one after the other. Each check begins in the state Pre-operational, with its own log of
//! the bus. The values that a check has written are restored after it. Each folder has the checks of one service.

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

pub use profiles::Profile;
pub use run::{Options, Result, Run, run};
pub use subject::{Deviation, Outcome, Setup, Stop, Subject, Verdict};

/// The names that every check needs.
mod prelude {
    pub(super) use canopen::nmt::{Command, State};

    pub(super) use super::subject::{OFF, RPDO, Refusal, TPDO, abort, ensure, fail, skip};
    pub(super) use super::{Check, Outcome, Stop, Subject};
}

/// A rule that a device has to follow.
#[derive(Clone, Copy, Debug)]
pub struct Check {
    /// The permanent name of the check: `SDO-07`.
    pub id: &'static str,
    /// The behaviour of a device that follows the rule.
    pub title: &'static str,
    /// The clause of the rule.
    pub clause: &'static str,
    /// The effect on the device that restoring the written values does not undo.
    pub effect: Effect,
    /// Whether the clause demands or recommends the rule.
    pub level: Level,
    /// The function that tries the rule.
    pub run: fn(&mut Subject<'_>) -> Outcome,
}

/// The effect of a check on the device that restoring the written values does not undo.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Effect {
    /// No such effect.
    None,
    /// Restarts the device or its communication. Values that are not saved are lost, and are written back after the
    /// run.
    Resets,
    /// Writes the non-volatile memory of the device, by 1010h, 1011h or LSS.
    Stores,
}

/// How strict a clause is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// A device that breaks the rule does not conform.
    Demanded,
    /// A device that breaks the rule still conforms.
    Recommended,
}

impl Check {
    /// A check of a demanded rule, without an effect on the device.
    const fn new(
        id: &'static str,
        title: &'static str,
        clause: &'static str,
        run: fn(&mut Subject<'_>) -> Outcome,
    ) -> Check {
        Check { id, title, clause, effect: Effect::None, level: Level::Demanded, run }
    }

    /// The same check, with a restart of the device as its effect.
    const fn resets(self) -> Check {
        Check { effect: Effect::Resets, ..self }
    }

    /// The same check, with writing the memory of the device as its effect.
    const fn stores(self) -> Check {
        Check { effect: Effect::Stores, ..self }
    }

    /// The same check, for a rule that is only recommended.
    const fn recommended(self) -> Check {
        Check { level: Level::Recommended, ..self }
    }

    /// The group of the check: the part of its name before the number.
    #[must_use]
    pub fn group(&self) -> &'static str {
        self.id.split('-').next().unwrap_or_default()
    }

    /// Whether a text names this check: by its name, by its group, or by the beginning of either.
    #[must_use]
    pub fn is_meant(&self, text: &str) -> bool {
        !text.is_empty() && self.id.to_ascii_uppercase().starts_with(&text.to_ascii_uppercase())
    }
}

/// The subject of the checks of a group.
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

/// The checks of CiA 301 and 305, in the order in which they run, then the checks of a profile.
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
