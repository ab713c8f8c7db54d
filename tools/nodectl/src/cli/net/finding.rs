//! Findings: in what a bus is not as its file says.

use std::fmt;

use serde::Serialize;

use super::{Failure, Session};

/// A finding.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub(super) struct Finding {
    /// The node; `None` for the bus.
    pub(super) node: Option<u8>,
    /// The item that differs from the file.
    pub(super) what: What,
    /// In words, with both values.
    pub(super) text: String,
}

/// The item that differs from the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum What {
    /// The node does not answer.
    Missing,
    /// A node is there that the file does not have.
    Unexpected,
    /// 1000h
    DeviceType,
    /// 1018h:1
    Vendor,
    /// 1018h:2
    Product,
    /// 1018h:3
    Revision,
    /// 1018h:4
    Serial,
    /// 1009h
    Hardware,
    /// 100Ah
    Software,
    /// The data sheet of the file is for another device.
    Sheet,
    /// 1020h
    Date,
    /// A parameter.
    Value,
    /// No heartbeat comes.
    Heartbeat,
    /// The NMT state.
    State,
    /// Two nodes send with one CAN-ID.
    CanId,
    /// The node refuses a value or a transfer.
    Refused,
}

impl Finding {
    /// A finding about a node.
    pub(super) fn new(node: canopen::NodeId, what: What, text: String) -> Finding {
        Finding { node: Some(node.get()), what, text }
    }

    /// A finding about a node that is silent or refuses something.
    ///
    /// # Errors
    /// Any other failure: it ends the command.
    pub(super) fn of_failure(node: canopen::NodeId, failure: Failure) -> Result<Finding, Failure> {
        let what = match &failure {
            Failure::Sdo(error) if error.is_silence() => What::Missing,
            Failure::Sdo(error) if error.abort().is_some() => What::Refused,
            _ => return Err(failure),
        };
        Ok(Finding::new(node, what, failure.to_string()))
    }
}

/// `node 5: product: 00000001h instead of 00000007h`
impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let what = serde_json::to_value(self.what).ok();
        let what = what.as_ref().and_then(serde_json::Value::as_str).unwrap_or_default();
        match self.node {
            Some(node) => write!(f, "node {node}: {what}: {}", self.text),
            None => write!(f, "{what}: {}", self.text),
        }
    }
}

/// Prints findings.
pub(super) fn print(session: &mut Session, findings: &[Finding]) -> Result<(), Failure> {
    findings.iter().try_for_each(|finding| session.print(finding))
}

/// The end of a command with this number of findings.
pub(super) fn end(count: usize) -> Result<(), Failure> {
    if count == 0 { Ok(()) } else { Err(Failure::NotAsPlanned(count)) }
}
