//! Process data: frames of FIFO 0, the snapshot of each millisecond, the timers of SYNC and PDO, the lamps. And the one who notices
//! that there are no more snapshots.

use bsp::losses::{Event, Losses};
use bsp::{Alarm, Clock, Frames, Lamps, Received, Ring};
use canopen::{Duration, Instant, Next};
use rtic::Mutex;

use crate::shared::Shared;
use crate::snapshot_slot::SnapshotSlot;
use crate::{SAMPLING, SERVICES};

/// What the task owns.
pub(crate) struct Process {
    frames: Frames,
    alarm: Alarm,
    lamps: Lamps,
    /// When the last snapshot came, or one was last asked for.
    sampled: Instant,
    lost: &'static Losses,
}

/// Snapshots come every millisecond. After so long without one the sampling task has to see what is wrong.
const OVERDUE: Duration = Duration::from_millis(2);

impl Process {
    pub(crate) fn new(frames: Frames, alarm: Alarm, lamps: Lamps, lost: &'static Losses) -> Process {
        Process { frames, alarm, lamps, sampled: Clock::now(), lost }
    }

    /// Hands on the alarm of the services, which this task's interrupt brings. It comes by every millisecond, so an alarm whose
    /// interrupt was lost is not much later.
    pub(crate) fn wake_services(&mut self, ring: Ring) {
        if ring == Ring::Missed {
            self.lost.count(Event::Alarm);
        }
        if ring != Ring::No {
            rtic::pend(SERVICES);
        }
    }

    /// Does everything that is due and sets the alarm for what comes next.
    pub(crate) fn run(&mut self, snapshot: &mut impl Mutex<T = SnapshotSlot>, node: &mut impl Shared) {
        while let Some(Received { frame, at }) = self.frames.dequeue() {
            let next = node.call(|protocol, out| protocol.on_process_frame(&frame, at, out));
            self.follow(next, at);
        }
        let now = Clock::now();
        let (has_sampled, next, outputs) = node.call(|protocol, out| {
            let is_new = snapshot.lock(|slot| slot.take(protocol.snapshot_mut()));
            let next = if is_new { protocol.publish(now, out) } else { protocol.poll_process(now, out) };
            (is_new, next, protocol.outputs())
        });
        self.watch(has_sampled, now);
        self.follow(next, now);
        self.lamps.set(outputs.digital);
    }

    /// Sets the alarm, and wakes the services where they are due: NMT may have asked for something.
    fn follow(&mut self, next: Next, now: Instant) {
        self.alarm.set(next.process.min(self.sampled + OVERDUE));
        if next.services <= now {
            rtic::pend(SERVICES);
        }
    }

    fn watch(&mut self, has_sampled: bool, now: Instant) {
        let is_overdue = now >= self.sampled + OVERDUE;
        if is_overdue && !has_sampled {
            rtic::pend(SAMPLING);
        }
        if is_overdue || has_sampled {
            self.sampled = now;
        }
    }
}
