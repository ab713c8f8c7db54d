//! Process data: frames of FIFO 0, the snapshot of each millisecond, the timers of SYNC and PDO, the lamps.

use bsp::{Alarm, Clock, Frames, Lamps, Received};
use canopen::{Instant, Next};
use node::Snapshot;

use crate::SERVICES;
use crate::shared::Shared;

/// What the task owns.
pub(crate) struct Process {
    pub(crate) frames: Frames,
    pub(crate) alarm: Alarm,
    pub(crate) lamps: Lamps,
}

impl Process {
    /// Does everything that is due and sets the alarm for what comes next.
    pub(crate) fn run(&mut self, snapshot: Option<Snapshot>, node: &mut impl Shared) {
        while let Some(Received { frame, at }) = self.frames.dequeue() {
            let next = node.call(|protocol, out| protocol.on_process_frame(&frame, at, out));
            self.follow(next, at);
        }
        let now = Clock::now();
        let (next, lit) = node.call(|protocol, out| {
            let next = match snapshot {
                Some(snapshot) => protocol.publish(&snapshot, now, out),
                None => protocol.poll_process(now, out),
            };
            (next, protocol.lamps())
        });
        self.follow(next, now);
        self.lamps.set(lit);
    }

    /// Sets the alarm, and wakes the services where they are due: NMT may have asked for something.
    fn follow(&mut self, next: Next, now: Instant) {
        self.alarm.set(next.process);
        if next.services <= now {
            rtic::pend(SERVICES);
        }
    }
}
