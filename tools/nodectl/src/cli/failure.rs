//! Failures of commands, and their exit codes.

use std::io;
use std::path::PathBuf;

use canopen::client::lss::Error as Service;
use canopen::client::sdo as transfer;
use thiserror::Error;

use crate::acquisition::Interruption;
use crate::bus::BusError;
use crate::net::PlanError;
use crate::object::Place;
use crate::sdo::{self, Cause};
use crate::text::counted;
use crate::{lss, update};

/// The exit codes, for the end of the help text.
pub(super) const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  a node refused: SDO abort, LSS error code
  2  the command line is wrong
  3  no answer in time, or one against the protocol
  4  the bus cannot be opened, or is lost
  5  the node did not accept the new program, or has another than it was given
  6  the program is not for this node, or that of the node is on trial; no program was erased
  7  a file cannot be read or written
  8  two configurations differ (diff)
  9  the device does not conform (check)
 10  a rule of the bus is broken (rules)
 11  the bus is not as its file says (net)
130  interrupted by Ctrl-C or SIGTERM (check)";

/// The exit code of checks that the user has interrupted.
pub(super) const INTERRUPTED: u8 = 130;

/// Why a command failed.
#[derive(Debug, Error)]
pub enum Failure {
    /// The command line has an error.
    #[error("{0}")]
    Usage(String),
    /// A transfer failed.
    #[error(transparent)]
    Sdo(#[from] sdo::Error),
    /// LSS failed.
    #[error(transparent)]
    Lss(#[from] lss::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
    /// The update of a node has failed.
    #[error(transparent)]
    Update(#[from] update::Error),
    /// Some nodes were not updated; each failure has been printed already.
    #[error("{failed} of {all} nodes were not updated")]
    Nodes {
        /// The number of nodes that were not updated.
        failed: usize,
        /// The number of all nodes.
        all: usize,
        /// The exit code of the first node that was not updated.
        exit_code: u8,
    },
    /// Some objects could not be read; each failure has been printed already.
    #[error("{failed} of {all} objects could not be read")]
    Objects {
        /// The number of objects that could not be read.
        failed: usize,
        /// The number of all objects.
        all: usize,
        /// The exit code of the first object that could not be read.
        exit_code: u8,
    },
    /// Some nodes are not in the file that was written; each failure has been printed already.
    #[error("{missing} of {all} nodes {} not in the file", if *.missing == 1 { "is" } else { "are" })]
    LeftOut {
        /// The number of nodes that could not be read.
        missing: usize,
        /// The number of all nodes.
        all: usize,
        /// The exit code of the first node that could not be read.
        exit_code: u8,
    },
    /// Two configurations differ.
    #[error("{}", counted(*.0, "parameter differs", "parameters differ"))]
    Different(usize),
    /// Checks have failed, or the device has not taken back a changed value; both have been printed already.
    #[error("{}{}", counted(*.failed, "check failed", "checks failed"), left_words(.left_behind))]
    NotConforming {
        /// The number of failed checks.
        failed: usize,
        /// The values that the device has not taken back.
        left_behind: Vec<String>,
    },
    /// The user has interrupted the checks; the results until then have been printed already.
    #[error("interrupted{}", left_words(.left_behind))]
    Interrupted {
        /// The values that the device has not taken back.
        left_behind: Vec<String>,
    },
    /// Rules of the bus are broken; each breach has been printed already.
    #[error("{}", counted(*.0, "breach of the rules of the bus", "breaches of the rules of the bus"))]
    RulesBroken(usize),
    /// The bus is not as its file says; each finding has been printed already.
    #[error("the bus is not as its file says: {}", counted(*.0, "finding", "findings"))]
    NotAsPlanned(usize),
    /// A node has other values than the values that were written.
    #[error("still different after it was written: {0}")]
    NotApplied(String),
    /// A node has not answered.
    #[error("{0}")]
    Silence(String),
    /// The file of a network has a mistake.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// A file cannot be read or written.
    #[error("{path}: {reason}")]
    File {
        /// The file.
        path: PathBuf,
        /// The reason.
        reason: String,
    },
    /// The result cannot be written.
    #[error("cannot write the result: {0}")]
    Output(#[from] io::Error),
}

impl Failure {
    /// A file that cannot be used.
    pub(super) fn file(path: &std::path::Path, reason: impl ToString) -> Failure {
        Failure::File { path: path.to_owned(), reason: reason.to_string() }
    }

    /// Whether the node does not answer, so that the command cannot go on.
    pub(super) fn is_silence(&self) -> bool {
        matches!(self, Failure::Sdo(error) if error.is_silence())
    }

    /// Whether the reader of the results has closed its end.
    #[must_use]
    pub fn is_closed_pipe(&self) -> bool {
        matches!(self, Failure::Output(error) if error.kind() == io::ErrorKind::BrokenPipe)
    }

    /// The failure as JSON: one schema for all commands.
    #[must_use]
    pub fn to_json(&self) -> serde_json::Value {
        let mut value = serde_json::json!({ "error": self.to_string(), "exit_code": self.exit_code() });
        if let Failure::Sdo(error) = self {
            value["node"] = error.node.get().into();
            value["object"] = Place(error.at).to_string().into();
            value["name"] = error.name.clone().into();
            value["abort"] = error.abort().map(|code| code.0).into();
        }
        value
    }

    /// The exit code of the process.
    #[must_use]
    pub fn exit_code(&self) -> u8 {
        match self {
            Failure::Usage(_) => 2,
            Failure::Different(_) => 8,
            Failure::NotConforming { .. } => 9,
            Failure::Interrupted { .. } => INTERRUPTED,
            Failure::RulesBroken(_) => 10,
            Failure::NotAsPlanned(_) => 11,
            Failure::NotApplied(_) => 1,
            Failure::Sdo(error) => sdo_code(error),
            Failure::Lss(lss::Error::Service(Service::Refused(..))) => 1,
            Failure::Lss(lss::Error::Service(Service::NoAnswer(_))) | Failure::Silence(_) => 3,
            Failure::Bus(_) | Failure::Lss(lss::Error::Bus(_)) => 4,
            Failure::Update(error) => update_code(error),
            Failure::Nodes { exit_code, .. }
            | Failure::Objects { exit_code, .. }
            | Failure::LeftOut { exit_code, .. } => *exit_code,
            Failure::Plan(_) | Failure::File { .. } | Failure::Output(_) => 7,
        }
    }
}

fn left_words(left_behind: &[String]) -> String {
    if left_behind.is_empty() { String::new() } else { format!(", not put back: {}", left_behind.join(", ")) }
}

fn sdo_code(error: &sdo::Error) -> u8 {
    match error.cause {
        Cause::Transfer(transfer::Error::Abort(_)) => 1,
        Cause::Transfer(_) | Cause::Busy => 3,
        Cause::Bus(_) => 4,
    }
}

/// The exit code for a node that was not updated.
pub(super) fn update_code(error: &update::Error) -> u8 {
    match error {
        update::Error::Sdo(error) | update::Error::Mixed(error) => sdo_code(error),
        update::Error::Closed { .. } => 1,
        update::Error::Bus(_) => 4,
        update::Error::Stuck { .. } | update::Error::Left { .. } | update::Error::Lost { .. } => 3,
        update::Error::Flash { .. } | update::Error::Identification { .. } => 5,
        update::Error::Board { .. }
        | update::Error::Older { .. }
        | update::Error::OnTrial { .. }
        | update::Error::OtherDownload { .. }
        | update::Error::NoTrial { .. } => 6,
    }
}

impl From<Interruption> for Failure {
    fn from(interruption: Interruption) -> Failure {
        match interruption {
            Interruption::Sdo(error) => error.into(),
            Interruption::Bus(error) => error.into(),
        }
    }
}
