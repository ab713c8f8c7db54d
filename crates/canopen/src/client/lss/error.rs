//! Errors of LSS services: refusals of slaves, and slaves that do not answer.

use core::fmt;

/// The services with an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Name {
    /// Switch state selective.
    Select,
    /// Configure node-ID.
    NodeId,
    /// Configure bit timing parameters.
    BitRate,
    /// Store configuration.
    Store,
    /// Inquire identity or node-ID.
    Inquire,
    /// Identify non-configured remote slave.
    Identify,
    /// Fastscan.
    Fastscan,
}

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Name::Select => "select",
            Name::NodeId => "node-ID",
            Name::BitRate => "bit rate",
            Name::Store => "store",
            Name::Inquire => "inquire",
            Name::Identify => "identify",
            Name::Fastscan => "fastscan",
        })
    }
}

/// A service that failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// No slave answered.
    NoAnswer(Name),
    /// The slave answered with an error code.
    Refused(Name, u8),
}

/// Error codes by service (CiA 305, 6.4).
impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::NoAnswer(name) => write!(f, "LSS {name}: no answer"),
            Error::Refused(Name::NodeId, 1) => f.write_str("LSS node-ID: the node-ID is out of range"),
            Error::Refused(Name::BitRate, 1) => {
                f.write_str("LSS bit rate: the slave does not have this bit rate")
            }
            Error::Refused(Name::Store, 1) => f.write_str("LSS store: the slave cannot store"),
            Error::Refused(Name::Store, 2) => f.write_str("LSS store: the memory of the slave has failed"),
            Error::Refused(name, 255) => write!(f, "LSS {name}: refused for a reason of the vendor's"),
            Error::Refused(name, code) => write!(f, "LSS {name}: refused with code {code}"),
        }
    }
}

impl core::error::Error for Error {}
