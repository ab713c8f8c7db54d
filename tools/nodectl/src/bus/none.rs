//! No bus at all.

use std::io;

use canopen::{Frame, Instant};

use super::{Bus, BusError, Received, clock};

/// The bus of a command that is about files: whoever uses it nonetheless is told that it is lost.
#[derive(Clone, Copy, Debug)]
pub struct NoBus;

impl Bus for NoBus {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn send(&mut self, _: &Frame) -> Result<(), BusError> {
        Err(lost())
    }

    fn receive(&mut self, _: Instant) -> Result<Option<Received>, BusError> {
        Err(lost())
    }
}

fn lost() -> BusError {
    BusError::Lost(io::Error::from(io::ErrorKind::NotConnected))
}
