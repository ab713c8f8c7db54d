//! Process data: frames of FIFO 0, the snapshot of each millisecond, the timers of SYNC and PDO, the lamps.

use bsp::{Alarm, Clock, Frames, Lamps, Received};
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
            node.call(|protocol, out| protocol.on_process_frame(&frame, at, out));
            // NMT may have asked for something, and moves the deadlines of the services.
            rtic::pend(SERVICES);
        }
        let now = Clock::now();
        let (next, lit) = node.call(|protocol, out| {
            if let Some(snapshot) = snapshot {
                protocol.publish(&snapshot, now, out);
            }
            (protocol.poll_process(now, out), protocol.lamps())
        });
        self.alarm.set(next);
        self.lamps.set(lit);
    }
}
