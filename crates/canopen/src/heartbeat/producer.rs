//! The heartbeat producer and the boot-up message (CiA 301, 7.2.8.2.2 and 7.2.8.3.2).

use crate::nmt::State;
use crate::transmit::{Context, RETRY};
use crate::{CanId, Frame, Span, Tick, Transmit};

/// Sends one boot-up message, then a heartbeat every period (1017h).
#[derive(Debug)]
pub(crate) struct Producer {
    /// Producer heartbeat time in ms; 0 for no heartbeat.
    period: u16,
    due: Tick,
    boot_up: bool,
}

impl Producer {
    pub(crate) const fn new() -> Producer {
        Producer { period: 0, due: Tick::NEVER, boot_up: false }
    }

    /// The epoch of the clock has moved.
    pub(crate) fn shift(&mut self, by: Span) {
        self.due.shift(by);
    }

    /// Makes the boot-up message due at once. It counts as the first heartbeat.
    pub(crate) fn boot_up(&mut self, period: u16, now: Tick) {
        *self = Producer { period, due: now, boot_up: true };
    }

    /// Changes the period, and sends the next heartbeat at once; 0 switches the heartbeat off.
    pub(crate) fn set_period(&mut self, period: u16, now: Tick) {
        self.period = period;
        if !self.boot_up {
            self.due = if period == 0 { Tick::NEVER } else { now };
        }
    }

    /// Whether the heartbeat is switched on: then the device is not guarded (CiA 301, 7.2.8.2).
    pub(crate) fn is_on(&self) -> bool {
        self.period != 0
    }

    /// Whether the boot-up message has not been sent yet.
    pub(crate) fn boots_up(&self) -> bool {
        self.boot_up
    }

    /// When the next message is due.
    pub(crate) fn due(&self) -> Tick {
        self.due
    }

    /// The latest instant at which a consumer with a time of 1.5 periods still expects the next heartbeat.
    pub(crate) fn latest(&self) -> Tick {
        match self.due {
            _ if self.boot_up => Tick::PAST,
            Tick::NEVER => Tick::NEVER,
            due => due.plus(Span::from_millis(self.period / 2)),
        }
    }

    /// Sends the boot-up message or the heartbeat, if it is due.
    pub(crate) fn poll(&mut self, id: CanId, state: State, context: &mut Context<'_, impl Transmit>) {
        if context.now < self.due {
            return;
        }
        let message = |state: State| Frame::data_frame(id, 1, [state.code(), 0, 0, 0, 0, 0, 0, 0]);
        let sent = if self.boot_up {
            context.send_boot_up(message(State::Initialising))
        } else {
            context.send_state(message(state))
        };
        if !sent {
            self.due = context.now.plus(RETRY);
            return;
        }
        self.boot_up = false;
        self.due = self.due.following(self.period, context.now);
    }
}
