//! A receive FIFO of three mailboxes (RM0390, bxCAN reception handling).

use std::collections::VecDeque;

use canbus::Time;

use super::mailbox::Registers;
use crate::register::{bit, flag};

const DEPTH: usize = 3;
const FULL: u32 = 3;
const FOVR: u32 = 4;
const RFOM: u32 = 5;

#[derive(Clone, Debug, Default)]
pub(crate) struct Fifo {
    mailboxes: VecDeque<Registers>,
    /// The last content of the output mailbox, which reads return while the FIFO is empty.
    output: Registers,
    full: bool,
    overrun: bool,
    /// The end of the release of the output mailbox (RFOM).
    release: Option<Time>,
}

impl Fifo {
    /// Stores a frame that has passed a filter. In a full FIFO the frame replaces the newest one or, when `locked`, is
    /// discarded; one frame is lost, and the result is `false`.
    pub(crate) fn store(&mut self, frame: Registers, locked: bool) -> bool {
        let room = self.mailboxes.len() < DEPTH;
        if room {
            self.mailboxes.push_back(frame);
            self.full |= self.mailboxes.len() == DEPTH;
        } else {
            self.overrun = true;
            if let (Some(last), false) = (self.mailboxes.back_mut(), locked) {
                *last = frame;
            }
        }
        self.show();
        room
    }

    /// CAN_RFxR.
    pub(crate) fn status(&self) -> u32 {
        self.mailboxes.len() as u32
            | flag(self.full, FULL)
            | flag(self.overrun, FOVR)
            | flag(self.release.is_some(), RFOM)
    }

    /// Writes CAN_RFxR: clears flags, and begins a release of the output mailbox, which ends at `released`.
    pub(crate) fn write_status(&mut self, value: u32, released: Time) {
        self.full &= !bit(value, FULL);
        self.overrun &= !bit(value, FOVR);
        if bit(value, RFOM) && !self.mailboxes.is_empty() {
            self.release.get_or_insert(released);
        }
    }

    /// The end of the release of the output mailbox.
    pub(crate) fn deadline(&self) -> Time {
        self.release.unwrap_or(Time::NEVER)
    }

    /// Processes everything that is due up to `now`.
    pub(crate) fn advance(&mut self, now: Time) {
        if self.release.take_if(|release| *release <= now).is_some() {
            self.mailboxes.pop_front();
            self.show();
        }
    }

    /// The mailbox that software sees.
    pub(crate) fn output(&self) -> &Registers {
        &self.output
    }

    /// Level of the interrupt line for the three enable bits FMPIE, FFIE and FOVIE.
    pub(crate) fn interrupt(&self, enable: u32) -> bool {
        bit(enable, 0) && !self.mailboxes.is_empty()
            || bit(enable, 1) && self.full
            || bit(enable, 2) && self.overrun
    }

    fn show(&mut self) {
        if let Some(first) = self.mailboxes.front() {
            self.output = *first;
        }
    }
}
