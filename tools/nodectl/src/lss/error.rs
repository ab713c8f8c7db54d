//! The errors of LSS services.

use canopen::client::lss;
use thiserror::Error;

use crate::bus::BusError;

/// Why a service failed.
#[derive(Debug, Error)]
pub enum Error {
    /// No slave has answered, or a slave has refused.
    #[error(transparent)]
    Service(#[from] lss::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}
