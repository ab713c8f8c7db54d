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
    /// What the output mailbox showed last, for reads while it is empty.
    output: Registers,
    full: bool,
    overrun: bool,
    /// When the output mailbox, which software gives back, makes room for the next one.
    release: Option<Time>,
}

impl Fifo {
    /// Stores a frame that has passed a filter. When three wait, the newest of them is replaced or, `locked`, kept:
    /// one frame is lost, and the answer is `false`.
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

    /// Writes CAN_RFxR: clears flags, and gives the output mailbox back until an instant.
    pub(crate) fn write_status(&mut self, value: u32, released: Time) {
        self.full &= !bit(value, FULL);
        self.overrun &= !bit(value, FOVR);
        if bit(value, RFOM) && !self.mailboxes.is_empty() {
            self.release.get_or_insert(released);
        }
    }

    /// When the output mailbox changes by itself.
    pub(crate) fn deadline(&self) -> Time {
        self.release.unwrap_or(Time::NEVER)
    }

    /// Lets everything due up to `now` happen.
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
