//! The bus of commands that need none.

use std::io;

use canopen::{Frame, Instant};

use super::{Bus, BusError, Received, clock};

/// The bus of a command that works on files only: every access fails, as on a lost bus.
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
