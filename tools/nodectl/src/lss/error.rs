//! Why a service failed.

use canopen::client::lss;
use thiserror::Error;

use crate::bus::BusError;

/// A service that failed.
#[derive(Debug, Error)]
pub enum Error {
    /// No slave answered, or one refused.
    #[error(transparent)]
    Service(#[from] lss::Error),
    /// The bus failed.
    #[error(transparent)]
    Bus(#[from] BusError),
}
