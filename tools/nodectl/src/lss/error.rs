//! What a slave refuses.

use thiserror::Error;

use crate::bus::BusError;

/// A service that failed.
#[derive(Debug, Error)]
pub enum Error {
    /// No slave answered.
    #[error("LSS {service}: no answer")]
    NoAnswer {
        /// The service.
        service: &'static str,
    },
    /// The slave answered with an error code.
    #[error("LSS {service}: {}", words(*.code, service))]
    Refused {
        /// The service.
        service: &'static str,
        /// The error code.
        code: u8,
    },
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}

/// Error codes by service (CiA 305, 6.4).
fn words(code: u8, service: &str) -> String {
    match (code, service) {
        (1, "node-ID") => "the node-ID is out of range".to_owned(),
        (1, "bit rate") => "the slave does not have this bit rate".to_owned(),
        (1, "store") => "the slave cannot store".to_owned(),
        (2, "store") => "the memory of the slave has failed".to_owned(),
        (255, _) => "refused for a reason of the vendor's".to_owned(),
        _ => format!("refused with code {code}"),
    }
}
