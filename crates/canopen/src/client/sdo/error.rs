//! Why a transfer failed.

use core::fmt;

use super::AbortCode;
use crate::sdo::Abort;

/// Why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The server refused or gave up.
    Abort(AbortCode),
    /// The server did not answer in time.
    NoAnswer,
    /// The answer of the server violates the protocol.
    Unexpected,
    /// The data of a block upload does not match its CRC.
    Crc,
    /// The server sends more data than the sink has room for.
    TooLong,
    /// The transfer took longer than [`Options::limit`](super::Options::limit).
    Late,
    /// The client has cancelled the transfer ([`Transfer::abort`](super::Transfer::abort)).
    Cancelled,
}

/// CiA 301, 7.2.4.3.17. `Abort` lacks this code because no server of this crate sends it.
const OUT_OF_MEMORY: AbortCode = AbortCode(0x0504_0005);

impl Error {
    /// Abort code that the client sends when it gives up; `None` when the server has ended the transfer.
    #[must_use]
    pub fn abort(self) -> Option<AbortCode> {
        match self {
            Error::Abort(_) => None,
            Error::NoAnswer | Error::Late => Some(Abort::TimeOut.into()),
            Error::Unexpected => Some(Abort::Command.into()),
            Error::Crc => Some(Abort::Crc.into()),
            Error::TooLong => Some(OUT_OF_MEMORY),
            Error::Cancelled => Some(Abort::General.into()),
        }
    }

    /// Whether another attempt may succeed: a frame was lost, or came twice.
    #[must_use]
    pub fn is_worth_a_retry(self) -> bool {
        match self {
            Error::NoAnswer | Error::Unexpected => true,
            Error::Abort(code) => code.is_time_out(),
            _ => false,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Abort(code) => write!(f, "{code}"),
            Error::NoAnswer => f.write_str("no answer"),
            Error::Unexpected => f.write_str("the node answers against the protocol"),
            Error::Crc => f.write_str("the data arrived with a CRC error"),
            Error::TooLong => f.write_str("the node sends more data than expected"),
            Error::Late => f.write_str("the transfer takes too long"),
            Error::Cancelled => f.write_str("the transfer was given up"),
        }
    }
}

impl core::error::Error for Error {}
