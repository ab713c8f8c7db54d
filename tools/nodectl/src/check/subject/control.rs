//! The NMT state of the device and its restart.

use canopen::nmt::{Command, State};

use super::verdict::{Outcome, fail, skip};
use super::{Refusal, Subject, abort};

/// How long a device may take to change its state.
const SETTLE: u64 = 20;

/// How long to wait for a heartbeat with a fixed period.
const SLOWEST: u64 = 2500;

/// After this time a device that answers again counts as booted, even without a boot-up message.
const MUTE: u64 = 1500;

impl Subject<'_> {
    /// Sends an NMT command to the device.
    pub(in crate::check) fn command(&mut self, command: Command) -> Outcome {
        self.send(0x000, &command.encode(Some(self.setup.node)))
    }

    /// Brings the device into a state, and waits a short time.
    pub(in crate::check) fn enter(&mut self, state: State) -> Outcome {
        self.command(match state {
            State::Operational => Command::Start,
            State::Stopped => Command::Stop,
            _ => Command::EnterPreOperational,
        })?;
        self.pass(SETTLE)
    }

    /// The CAN-ID of heartbeat, boot-up and guarding.
    pub(in crate::check) fn error_control(&self) -> u16 {
        0x700 + self.id()
    }

    /// Switches the heartbeat on; skipped where the device has no 1017h. A device with a fixed heartbeat time keeps its
    /// time.
    pub(in crate::check) fn beat(&mut self, ms: u16) -> Outcome {
        self.need(0x1017, 0)?;
        match self.change(0x1017, 0, &ms.to_le_bytes())? {
            Ok(()) => Ok(()),
            Err(Refusal(abort::READ_ONLY)) if self.number(0x1017, 0)? > 0 => Ok(()),
            Err(Refusal(abort::READ_ONLY)) => Err(skip("1017h is 0 and cannot be written")),
            Err(refusal) => Err(fail(format!("1017h takes {ms}"), refusal)),
        }
    }

    /// The state in the next heartbeat. The heartbeat has to be on.
    pub(in crate::check) fn told_state(&mut self) -> Outcome<u8> {
        let (mark, id) = (self.mark(), self.error_control());
        let heard = match self.next(mark, id, 500)? {
            Some(heard) => Some(heard),
            None => self.next(mark, id, SLOWEST)?,
        };
        let heard = heard.ok_or_else(|| fail("a heartbeat", format!("none in {SLOWEST} ms")))?;
        heard.frame.data().first().copied().ok_or_else(|| fail("a heartbeat of one byte", "no byte"))
    }

    /// Demands that the next heartbeat tells this state.
    pub(in crate::check) fn tells(&mut self, state: State) -> Outcome {
        let seen = self.told_state()?;
        if seen == state.code() {
            return Ok(());
        }
        Err(fail(format!("a heartbeat with the state {:02X}h", state.code()), format!("{seen:02X}h")))
    }

    /// Restarts the device or its communication, and waits for the boot-up message.
    pub(in crate::check) fn reset(&mut self, command: Command) -> Outcome {
        self.go_on()?;
        // A device that boots could not get its values back.
        self.sheltered(|s| s.reset_and_wait(command))
    }

    fn reset_and_wait(&mut self, command: Command) -> Outcome {
        let (mark, id, time) = (self.mark(), self.error_control(), self.setup.boot.0 / 1000);
        self.command(command)?;
        let until = self.network.now().0 / 1000 + time;
        loop {
            let left = until.saturating_sub(self.network.now().0 / 1000);
            let boot_ups = self.heard(mark, id).iter().filter(|heard| heard.frame.data() == [0]).count();
            if boot_ups > 0 {
                return self.pass(SETTLE);
            }
            // Check NMT-01 reports a boot-up message whose data is not 0. The other checks accept such a message.
            let is_back =
                time - left > MUTE && self.heard(mark, id).iter().any(|heard| heard.frame.data() != [0]);
            if is_back && self.is_served()? {
                return self.pass(SETTLE);
            }
            if left == 0 {
                return Err(fail("a boot-up message", format!("none in {time} ms")));
            }
            self.pass(left.min(SETTLE))?;
        }
    }

    /// Skips the check where the device starts by itself after a restart, instead of staying in Pre-operational.
    pub(in crate::check) fn need_no_self_start(&mut self) -> Outcome {
        match self.optional(0x1F80, 0)? {
            Some(value) if value & 0x04 == 0 && value != 0 => {
                Err(skip("1F80h lets the device start by itself"))
            }
            _ => Ok(()),
        }
    }
}
