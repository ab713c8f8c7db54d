//! Restarts of one node: why it restarts, and what it sends before its boot-up message.

use canopen::{Duration, Instant};

use crate::{Findings, Rule};

/// The time in which a node acts on a command, in us.
const REACTION: u64 = 1500;

/// The start of a node.
#[derive(Debug, Default)]
pub(crate) struct Boot {
    /// The node restarts since then, and has not sent its boot-up message.
    since: Option<Instant>,
    /// The next boot-up message has a reason.
    has_reason: bool,
    /// The node runs programs that start each other: resets need no further reason.
    is_updated: bool,
    has_booted: bool,
}

impl Boot {
    /// The node is switched on, or it or its chip was reset.
    pub(crate) fn restarts(&mut self, now: Instant) {
        (self.since, self.has_reason) = (Some(now), true);
    }

    /// Something may restart the node: LSS, or a write to its program control.
    pub(crate) fn may_restart(&mut self) {
        self.has_reason = true;
    }

    /// The program of the node is changed.
    pub(crate) fn is_updated(&mut self) {
        self.is_updated = true;
    }

    /// Whether the programs of the node change: a bootloader that copies a program sends no heartbeat meanwhile.
    pub(crate) fn is_updating(&self) -> bool {
        self.is_updated
    }

    /// Whether the boot-up message of a restart is awaited.
    pub(crate) fn is_waiting(&self) -> bool {
        self.since.is_some()
    }

    /// Whether a boot-up message may be next although no restart was seen: the first one, or that of a node with a command
    /// to restart.
    pub(crate) fn may_be_starting(&self) -> bool {
        !self.has_booted || self.has_reason || self.is_updated
    }

    /// A boot-up message. Returns whether the restart was not seen before it.
    pub(crate) fn boot_up(&mut self, is_injected: bool, findings: &mut Findings) -> bool {
        let is_first = !std::mem::replace(&mut self.has_booted, true);
        let has_reason = std::mem::take(&mut self.has_reason);
        let was_seen = self.since.take().is_some();
        if !(is_first || has_reason || self.is_updated || is_injected) {
            findings.push((Rule::UnexpectedReset, "a boot-up message without a command".to_owned()));
        }
        !was_seen && !has_reason
    }

    /// Any other frame, which began at `start`; the frames that were being sent may still end.
    pub(crate) fn other_frame(&mut self, start: Instant, frame_time: Duration, findings: &mut Findings) {
        let Some(since) = self.since else { return };
        if start.0 > since.0 + REACTION + frame_time.0 && !self.is_updated {
            self.since = None;
            findings.push((
                Rule::BeforeBootUp,
                "a frame after a reset and before the boot-up message".to_owned(),
            ));
        }
    }
}
