//! Sending of frames, and the log of the frames of the device.

use canopen::{Duration, Frame};

use super::Subject;
use super::verdict::{Outcome, skip};
use crate::Logged;

/// The time between two looks whether the run is interrupted.
const LOOK: Duration = Duration::from_millis(100);

/// A place in the log of the bus.
#[derive(Clone, Copy, Debug)]
pub(in crate::check) struct Mark(usize);

impl Subject<'_> {
    /// The present end of the log.
    pub(in crate::check) fn mark(&self) -> Mark {
        Mark(self.network.log().len())
    }

    /// Lets `ms` milliseconds pass.
    pub(in crate::check) fn pass(&mut self, ms: u64) -> Outcome {
        let end = self.network.now() + Duration::from_millis(ms);
        loop {
            self.go_on()?;
            let left = Duration(end.0.saturating_sub(self.network.now().0));
            self.network.pause(left.min(LOOK))?;
            if left <= LOOK {
                break;
            }
        }
        self.network.forget();
        Ok(())
    }

    /// Sends a frame.
    pub(in crate::check) fn send(&mut self, id: u16, data: &[u8]) -> Outcome {
        self.transmit(Frame::new(id, data))
    }

    /// Sends a remote frame.
    pub(in crate::check) fn remote(&mut self, id: u16, len: u8) -> Outcome {
        self.transmit(Frame::remote(id, len))
    }

    fn transmit(&mut self, frame: Option<Frame>) -> Outcome {
        match frame {
            Some(frame) => Ok(self.network.send(&frame)?),
            None => Err(skip("no such frame can be sent")),
        }
    }

    /// The frames that have come since a place in the log.
    pub(in crate::check) fn since(&self, mark: Mark) -> impl Iterator<Item = &Logged> {
        self.network.log().iter().skip(mark.0).filter(|logged| !logged.is_sent)
    }

    /// The data frames with this CAN-ID that have come since a place in the log.
    pub(in crate::check) fn heard(&self, mark: Mark, id: u16) -> Vec<Logged> {
        self.since(mark)
            .filter(|logged| logged.frame.id() == id && !logged.frame.is_remote())
            .copied()
            .collect()
    }

    /// The newest data frame with this CAN-ID in the log.
    pub(in crate::check) fn newest(&self, id: u16) -> Option<Logged> {
        self.heard(Mark(0), id).last().copied()
    }

    /// The first data frame with this CAN-ID since a place in the log. Waits up to `ms` milliseconds for the frame.
    pub(in crate::check) fn next(&mut self, mark: Mark, id: u16, ms: u64) -> Outcome<Option<Logged>> {
        let until = self.network.now() + Duration::from_millis(ms);
        loop {
            if let Some(heard) = self.heard(mark, id).first() {
                return Ok(Some(*heard));
            }
            self.go_on()?;
            let now = self.network.now();
            if now >= until {
                return Ok(None);
            }
            self.network.wait(until.min(now + LOOK), |frame| (frame.id() == id).then_some(()))?;
            self.network.forget();
        }
    }

    /// Sends a SYNC, and waits until the SYNC has had its effect.
    pub(in crate::check) fn sync(&mut self) -> Outcome {
        self.send(0x080, &[])?;
        self.pass(20)
    }

    /// Skips the check while other nodes are on the bus. Needed before sending a frame that is for all nodes.
    pub(in crate::check) fn need_solitude(&self) -> Outcome {
        if self.has_company {
            Err(skip("other nodes are on the bus, and the frame would be for them too"))
        } else {
            Ok(())
        }
    }

    /// Listens for this time whether other nodes are on the bus.
    pub(in crate::check) fn look_round(&mut self, ms: u64) -> Outcome {
        let mark = self.mark();
        self.pass(ms)?;
        let own = self.id();
        let others = self
            .since(mark)
            .filter(|logged| matches!(logged.frame.id(), 0x701..=0x77F) && logged.frame.id() & 0x7F != own);
        self.has_company = others.count() > 0;
        Ok(())
    }
}
