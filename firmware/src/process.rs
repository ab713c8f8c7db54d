//! Process data: frames of FIFO 0, the snapshot of each millisecond, the timers of SYNC and PDO, the lamps. Also
//! detects that snapshots are missing.

use bsp::losses::{Event, Losses};
use bsp::{Alarm, Clock, Frames, Lamps, Received, Ring};
use canopen::{Duration, Instant, Next};
use rtic::Mutex;

use crate::exchange::Exchange;
use crate::shared::Shared;
use crate::{SAMPLING, SERVICES};

/// The data that the task owns.
pub(crate) struct Process {
    frames: Frames,
    alarm: Alarm,
    lamps: Lamps,
    /// Time of the last snapshot, or of the last request for one.
    sampled: Instant,
    lost: &'static Losses,
}

/// Time without a snapshot, which should come every millisecond, after which the sampling task is woken to check.
const OVERDUE: Duration = Duration::from_millis(2);

impl Process {
    pub(crate) fn new(frames: Frames, alarm: Alarm, lamps: Lamps, lost: &'static Losses) -> Process {
        Process { frames, alarm, lamps, sampled: Clock::now(), lost }
    }

    /// Passes on the alarm of the services, which arrives with this task's interrupt. The task runs every millisecond,
    /// so an alarm whose interrupt was lost is not much later.
    pub(crate) fn wake_services(&mut self, ring: Ring) {
        if ring == Ring::Missed {
            self.lost.count(Event::Alarm);
        }
        if ring != Ring::No {
            rtic::pend(SERVICES);
        }
    }

    /// Does everything that is due, and sets the alarm for the next deadline.
    pub(crate) fn run(&mut self, exchange: &mut impl Mutex<T = Exchange>, node: &mut impl Shared) {
        while let Some(Received { frame, at }) = self.frames.dequeue() {
            let next = node.call(|protocol, out| protocol.on_process_frame(&frame, at, out));
            self.follow(next, at);
        }
        let now = Clock::now();
        let (has_sampled, next, outputs) = node.call(|protocol, out| {
            let is_new = exchange.lock(|exchange| exchange.take(protocol.snapshot_mut()));
            let next = if is_new { protocol.publish(now, out) } else { protocol.poll_process(now, out) };
            (is_new, next, protocol.outputs())
        });
        self.watch(has_sampled, now);
        self.follow(next, now);
        self.lamps.set(outputs.digital);
    }

    /// Sets the alarm, and wakes the services if they are due, for example after an NMT command.
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
