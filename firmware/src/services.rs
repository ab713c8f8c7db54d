//! Services: frames of FIFO 1, heartbeat, SDO and EMCY, errors of the bus, and what the protocol asks of the firmware.

use bsp::bit_timing::BitTiming;
use bsp::bus_state::BusWatch;
use bsp::can::Controller;
use bsp::filters::{self, Banks};
use bsp::led::Led;
use bsp::losses::Losses;
use bsp::{Alarm, Clock, Frames};
use canopen::{Duration, Instant};
use node::{BusEvent, Fault, Request};

use crate::PROCESS;
use crate::bus::event_of;
use crate::shared::Shared;

/// The task runs at least this often: the watchdog wants a sign of life, and a recovery of the bus raises no interrupt.
const PERIOD: Duration = Duration::from_millis(20);

/// What the task owns.
pub(crate) struct Services {
    pub(crate) can: Controller,
    pub(crate) timing: BitTiming,
    pub(crate) frames: Frames,
    pub(crate) lost: &'static Losses,
    pub(crate) alarm: Alarm,
    pub(crate) led: Led,
    watch: BusWatch,
    /// Going on the bus for the first time is a reset of the communication too.
    request: Option<Request>,
    /// The last run ended in a crash, and the bus has not been told yet.
    crashed: bool,
}

impl Services {
    /// Not on the bus yet: the first run goes there.
    pub(crate) fn new(
        can: Controller,
        timing: BitTiming,
        frames: Frames,
        lost: &'static Losses,
        alarm: Alarm,
        led: Led,
        crashed: bool,
    ) -> Services {
        let request = Some(Request::ResetCommunication);
        Services { can, timing, frames, lost, alarm, led, watch: BusWatch::default(), request, crashed }
    }

    /// Does everything that is due and sets the alarm for what comes next.
    pub(crate) fn run(&mut self, node: &mut impl Shared) {
        self.fulfil(node);
        self.report_bus(node);
        self.receive(node);
        let now = Clock::now();
        let next = node.call(|protocol, out| protocol.poll_services(now, out));
        self.fulfil(node);
        self.led.set(blink(now));
        self.alarm.set(next.min(now + PERIOD));
    }

    fn receive(&mut self, node: &mut impl Shared) {
        while let Some(received) = self.frames.dequeue() {
            node.call(|protocol, out| protocol.on_service_frame(&received.frame, received.at, out));
            self.fulfil(node);
            // A write to the dictionary moves the deadlines of the process data.
            rtic::pend(PROCESS);
        }
    }

    fn report_bus(&mut self, node: &mut impl Shared) {
        let now = Clock::now();
        let lost = self.lost.take();
        if lost > 0 {
            defmt::warn!("{=u32} received frames lost", lost);
            node.call(|protocol, out| protocol.bus_event(BusEvent::Overrun, now, out));
        }
        let change = self.watch.change(self.can.state());
        if let Some(event) = change.and_then(|(before, after)| event_of(before, after)) {
            node.call(|protocol, out| protocol.bus_event(event, now, out));
        }
    }

    /// Does what the protocol asks for, until it asks for nothing.
    fn fulfil(&mut self, node: &mut impl Shared) {
        while let Some(request) =
            self.request.take().or_else(|| node.call(|protocol, _| protocol.take_request()))
        {
            match request {
                Request::ResetNode => restart(),
                Request::ResetCommunication => self.join(node),
                Request::Filters => self.filter(node),
                Request::BitRate(kbit) => self.change_rate(kbit, node),
            }
        }
    }

    /// Goes on the bus, deaf at first: which identifiers are of interest is known after the start of the protocol.
    fn join(&mut self, node: &mut impl Shared) {
        defmt::info!("on the bus at {=u16} kbit/s", self.timing.kbit());
        node.call(|_, queue| queue.clear());
        self.can.start(self.timing, &Banks::new());
        node.call(|protocol, out| protocol.start(Clock::now(), out));
        if core::mem::take(&mut self.crashed) {
            node.call(|protocol, out| protocol.set_fault(Fault::UnexpectedReset, true, Clock::now(), out));
        }
        self.filter(node);
        rtic::pend(PROCESS);
    }

    fn filter(&mut self, node: &mut impl Shared) {
        let banks = node.call(|protocol, _| filters::pack(protocol.process_ids(), protocol.service_ids()));
        self.can.set_filters(&banks);
    }

    fn change_rate(&mut self, kbit: u16, node: &mut impl Shared) {
        let Some(timing) = BitTiming::of(kbit) else {
            return defmt::error!("no timing for {=u16} kbit/s", kbit);
        };
        self.timing = timing;
        self.can.start(timing, &Banks::new());
        self.filter(node);
    }
}

/// NMT reset node: everything begins anew, the bootloader included.
fn restart() -> ! {
    defmt::info!("reset node");
    cortex_m::peripheral::SCB::sys_reset()
}

/// One flash a second.
fn blink(now: Instant) -> bool {
    now.0 % 1_000_000 < 100_000
}
