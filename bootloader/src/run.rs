//! The main loop of the bootloader.

use bsp::can::transmit_queue::Mailboxes;
use bsp::pins::led::Led;
use bsp::{Alarm, Clock, Frames, StartUpWatchdog, Transmitter};
use canopen::{Duration, Instant};
use cortex_m::peripheral::SCB;

use crate::identity::Identity;
use crate::outbox::Outbox;
use crate::session::{Session, Then};
use crate::visit::Visit;

/// Polling interval while frames wait for a mailbox, because no interrupt signals a free mailbox.
const TRANSMIT_POLL: Duration = Duration::from_millis(1);

/// The data that the loop owns.
pub(crate) struct Run {
    pub(crate) session: Session,
    pub(crate) identity: Identity,
    pub(crate) frames: Frames,
    pub(crate) queue: Outbox,
    pub(crate) transmitter: Transmitter,
    pub(crate) alarm: Alarm,
    pub(crate) watchdog: StartUpWatchdog,
    pub(crate) led: Led,
}

impl Run {
    /// Serves the bus and the flash.
    pub(crate) fn forever(&mut self) -> ! {
        let mut visit = Visit::begin(self.identity, &mut self.session, &mut self.queue);
        loop {
            self.watchdog.feed();
            visit.go_on(&mut self.session, &mut self.frames, &mut self.queue);
            self.receive();
            let then = self.session.step(&mut self.queue);
            if visit.is_on_bus() {
                self.queue.pump(&mut self.transmitter);
            }
            self.led.set(blink(Clock::now()));
            match then {
                Then::Again => (),
                Then::Sleep(until) => self.sleep(visit.due().map_or(until, |due| due.min(until))),
                Then::Reset(latest) => self.reset(latest),
            }
        }
    }

    fn receive(&mut self) {
        while let Some(received) = self.frames.dequeue() {
            self.session.take(&received, &mut self.queue);
            self.queue.pump(&mut self.transmitter);
        }
    }

    /// Sleeps until a time, or until a frame comes. Masked interrupts also end the sleep, so an event between the check
    /// of the queue and the sleep is not missed.
    fn sleep(&mut self, until: Instant) {
        let soon = after(TRANSMIT_POLL);
        let until = if self.queue.is_empty() { until } else { until.min(soon) };
        cortex_m::interrupt::free(|_| {
            self.alarm.set(until);
            if !self.frames.ready() {
                bsp::sleep();
            }
        });
    }

    /// Resets the chip once all frames have been sent, or at `latest`.
    fn reset(&mut self, latest: Instant) {
        let all_is_said = self.queue.is_empty() && self.transmitter.is_idle();
        if all_is_said || Clock::now() >= latest {
            SCB::sys_reset()
        }
    }
}

/// The time in `span` from now. Not inlined, because there are many callers and little room in flash.
#[inline(never)]
pub(crate) fn after(span: Duration) -> Instant {
    Clock::now() + span
}

/// Two short flashes and a pause in a little more than a second, in steps of 2^17 us.
fn blink(now: Instant) -> bool {
    matches!(now.0 >> 17 & 7, 0 | 2)
}
