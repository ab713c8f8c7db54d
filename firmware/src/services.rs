//! Services: frames of FIFO 1, heartbeat, SDO and EMCY, errors of the bus, and actions that the protocol leaves to the
//! firmware.

use bsp::can::Controller;
use bsp::can::bus_state::{BusState, BusWatch};
use bsp::can::filters::{self, Banks};
use bsp::can::transmit_queue::TransmitQueue;
use bsp::chip::handover::Handover;
use bsp::chip::retained;
use bsp::losses::{EVENTS, Event, Losses};
use bsp::pins::led::{Indicators, Led};
use bsp::policy::back_off::BackOff;
use bsp::{Alarm, Clock, Frames};
use canopen::indicators::{self, BusHealth};
use canopen::{Duration, Instant};
use node::fault::{PARAMETER_STORE, PROGRAM_TAKEN_BACK, UNEXPECTED_RESET};
use node::{Action, BitRate, BusEvent, Fault, Next, NodeId, Parameters, Protocol, State};

use crate::bit_rate::{Origin, Rate};
use crate::bus::event_of;
use crate::shared::Shared;
use crate::{PROCESS, STORAGE};

/// The task runs at least this often: the watchdog needs a sign of life, and a recovery of the bus raises no interrupt.
const PERIOD: Duration = Duration::from_millis(20);

/// Time after its start at which the application is confirmed, if it is on the bus and measures. Earlier crashes add
/// up, and after three the bootloader stays.
const CONFIRMATION: Instant = Instant(10_000_000);

/// The data that the task owns.
pub(crate) struct Services {
    can: Controller,
    rate: Rate,
    frames: Frames,
    lost: &'static Losses,
    /// The counts of `lost` that have been reported.
    told: [u32; EVENTS],
    alarm: Alarm,
    led: Led,
    indicators: Indicators,
    watch: BusWatch,
    back_off: BackOff,
    /// Whether the node has been on the bus since its start.
    has_joined: bool,
    /// New parameters for the sampling task.
    parameters: Option<Parameters>,
    /// Faults found at start-up, until they have been reported.
    start_up_faults: StartUpFaults,
}

/// Faults that are found before the bus can be used.
#[derive(Clone, Copy)]
pub(crate) struct StartUpFaults {
    /// The last run ended in a crash.
    pub(crate) crashed: bool,
    /// Nothing can be stored.
    pub(crate) no_store: bool,
    /// The fault of the device record, if there is one.
    pub(crate) boot_data: Option<&'static Fault>,
}

impl StartUpFaults {
    fn all(&self) -> impl Iterator<Item = &'static Fault> {
        let crashed = self.crashed.then_some(&UNEXPECTED_RESET);
        let no_store = self.no_store.then_some(&PARAMETER_STORE);
        [crashed, no_store, self.boot_data].into_iter().flatten()
    }
}

impl Services {
    /// Not on the bus yet: the first run joins the bus.
    pub(crate) fn new(
        can: Controller,
        rate: Rate,
        frames: Frames,
        lost: &'static Losses,
        alarm: Alarm,
        (led, indicators): (Led, Indicators),
        start_up_faults: StartUpFaults,
    ) -> Services {
        Services {
            can,
            rate,
            frames,
            lost,
            told: [0; EVENTS],
            alarm,
            led,
            indicators,
            watch: BusWatch::default(),
            back_off: BackOff::default(),
            has_joined: false,
            parameters: None,
            start_up_faults,
        }
    }

    /// Does everything that is due, and sets the alarm for the next deadline.
    pub(crate) fn run(&mut self, node: &mut impl Shared) {
        if !core::mem::replace(&mut self.has_joined, true) {
            let next = self.join(node);
            let _ = self.settle(next, node);
        }
        if self.rate.is_searched() {
            self.search(node);
        } else {
            self.report_bus(node);
            self.receive(node);
        }
        self.report_losses(node);
        let now = Clock::now();
        let is_on_bus = self.can.state() != BusState::Off;
        let next = self.call(node, |protocol, out| {
            protocol.judge(now, is_on_bus);
            protocol.poll_services(now, out)
        });
        let next = self.settle(next, node);
        let crashes = retained::crashes();
        if now >= CONFIRMATION && crashes != crashes.confirmed() && self.is_well(node) {
            retained::set_crashes(crashes.confirmed());
        }
        self.led.set(blink(now));
        self.indicate(now, node);
        let next_look = (now + PERIOD).min(indicators::Indicators::next_change(now));
        self.alarm.set(next.services.min(next_look).min(self.back_off.due()));
        // The storage task must report to the watchdog, whether there is something to store or not.
        rtic::pend(STORAGE);
    }

    /// Shows the state of the node at its indicators.
    fn indicate(&mut self, now: Instant, node: &mut impl Shared) {
        let bus = match self.can.state() {
            _ if self.rate.is_searched() => BusHealth::Searching,
            BusState::Active => BusHealth::Good,
            BusState::Warning | BusState::Passive => BusHealth::Warning,
            BusState::Off => BusHealth::Off,
        };
        let shown = node.call(|protocol, _| protocol.indicators(bus));
        self.indicators.set(shown.levels(now));
    }

    /// Whether the node is on the bus and measures.
    fn is_well(&mut self, node: &mut impl Shared) -> bool {
        self.can.state() != BusState::Off && node.call(|protocol, _| protocol.is_at_work())
    }

    /// The changed parameters; a second call returns `None`.
    pub(crate) fn take_parameters(&mut self) -> Option<Parameters> {
        self.parameters.take()
    }

    /// Makes one call of the protocol.
    fn call(
        &mut self,
        node: &mut impl Shared,
        call: impl FnOnce(&mut Protocol, &mut TransmitQueue) -> Next,
    ) -> Next {
        let parameters = &mut self.parameters;
        let next = node.call(|protocol, out| {
            let next = call(protocol, out);
            if next.parameters {
                note_parameters(parameters, protocol);
            }
            next
        });
        if next.process <= Clock::now() {
            rtic::pend(PROCESS);
        }
        next
    }

    /// Carries out the actions that a call has left to the firmware, until none is left.
    fn settle(&mut self, mut next: Next, node: &mut impl Shared) -> Next {
        while let Some(action) = next.action {
            next = self.fulfil(action, node);
        }
        next
    }

    /// Continues the detection of the bit rate, and returns to the bus when it is found.
    fn search(&mut self, node: &mut impl Shared) {
        let Some(origin) = self.rate.go_on(&mut self.can, &mut self.frames, Clock::now()) else { return };
        if origin == Origin::Missing
            && let Rate::Known(timing) = self.rate
            && let Some(bit_rate) = BitRate::from_kbit(timing.kbit())
        {
            node.call(|protocol, _| protocol.adopt_bit_rate(bit_rate));
        }
        // LSS may have activated the detection in a node that is already running: it keeps its state and its values.
        if node.call(|protocol, _| protocol.state() == State::Initialising) {
            let next = self.join(node);
            let _ = self.settle(next, node);
        } else {
            self.go_on_bus(node);
        }
    }

    fn receive(&mut self, node: &mut impl Shared) {
        while let Some(received) = self.frames.dequeue() {
            let next = self.call(node, |protocol, out| {
                protocol.self_test(bsp::start::self_test::value);
                protocol.on_service_frame(&received.frame, received.at, out)
            });
            let _ = self.settle(next, node);
        }
    }

    fn report_bus(&mut self, node: &mut impl Shared) {
        let now = Clock::now();
        bsp::start::self_test::note_bus();
        let state = self.can.state();
        if state == BusState::Off {
            self.back_off.bus_off(now);
        }
        if self.back_off.is_over(now) {
            self.can.recover();
        }
        let change = self.watch.change(state);
        if let Some(event) = change.and_then(|(before, after)| event_of(before, after)) {
            self.report(event, now, node);
        }
    }

    /// Shows and logs the counts of lost hardware events. A lost frame also causes an EMCY.
    fn report_losses(&mut self, node: &mut impl Shared) {
        let all = self.lost.all();
        let told = core::mem::replace(&mut self.told, all);
        if all == told {
            return;
        }
        for (kind, count) in (1_u8..).zip(&all).filter(|(_, count)| **count > 0) {
            defmt::warn!("lost events of kind {=u8}: {=u32}", kind, count);
        }
        let has_lost_frame = all.get(Event::Frame as usize) != told.get(Event::Frame as usize);
        node.call(|protocol, _| protocol.show_lost_events(&all));
        if has_lost_frame {
            self.report(BusEvent::Overrun, Clock::now(), node);
        }
    }

    /// The resulting actions are found by the poll at the end of the run.
    fn report(&mut self, event: BusEvent, now: Instant, node: &mut impl Shared) {
        let _ = self.call(node, |protocol, _| protocol.bus_event(event, now));
    }

    /// Carries out one action that the protocol leaves to the firmware.
    fn fulfil(&mut self, action: Action, node: &mut impl Shared) -> Next {
        match action {
            Action::ResetNode => restart(),
            Action::ResetCommunication => return self.join(node),
            Action::Identifiers => self.filter(node),
            Action::BitRate(bit_rate) => {
                self.rate = Rate::of(bit_rate);
                self.go_on_bus(node);
            }
            Action::Bootloader => {
                self.hand_over(node, true);
                restart()
            }
            Action::Store(_) => rtic::pend(STORAGE),
        }
        self.call(node, |protocol, out| protocol.poll_services(Clock::now(), out))
    }

    /// Starts the communication if the bit rate is known, otherwise the detection of the bit rate.
    fn join(&mut self, node: &mut impl Shared) -> Next {
        if !self.go_on_bus(node) {
            return self.call(node, |protocol, out| protocol.poll_services(Clock::now(), out));
        }
        let faults = self.start_up_faults;
        let next = self.call(node, |protocol, out| {
            let now = Clock::now();
            // Before the start, which reports all faults before 1029h is applied to any.
            for fault in faults.all() {
                let _ = protocol.set_fault(fault, true, now);
            }
            // The fault is reported and cleared at once, because the running program is fine.
            let is_taken_back = protocol.is_taken_back();
            let _ = protocol.set_fault(&PROGRAM_TAKEN_BACK, is_taken_back, now);
            let next = protocol.start(now, out);
            let _ = protocol.set_fault(&PROGRAM_TAKEN_BACK, false, now);
            next
        });
        self.start_up_faults.crashed = false;
        rtic::pend(PROCESS);
        next
    }

    /// Joins the bus, without filters at first, because the identifiers are known only after the start of the
    /// protocol. False if the bit rate has to be detected first.
    fn go_on_bus(&mut self, node: &mut impl Shared) -> bool {
        node.call(|_, queue| queue.clear());
        let Rate::Known(timing) = self.rate else {
            self.rate.search(&mut self.can, &mut self.frames, Clock::now());
            return false;
        };
        defmt::info!("on the bus at {=u16} kbit/s", timing.kbit());
        self.can.start(timing, &Banks::new());
        if let Some(bit_rate) = BitRate::from_kbit(timing.kbit()) {
            node.call(|protocol, _| protocol.set_bus_bit_rate(bit_rate));
        }
        self.hand_over(node, false);
        self.filter(node);
        true
    }

    /// Leaves a note for the bootloader about node-ID and bit rate.
    fn hand_over(&self, node: &mut impl Shared, stay: bool) {
        let Rate::Known(timing) = self.rate else { return };
        let node_id = node.call(|protocol, _| protocol.node_id());
        retained::hand_over(&Handover { node_id: node_id.map(NodeId::get), timing, stay });
    }

    fn filter(&mut self, node: &mut impl Shared) {
        let banks =
            node.call(|protocol, _| filters::pack(protocol.process_filters(), protocol.service_ids()));
        self.can.set_filters(&banks);
    }
}

/// Restarts everything, including the bootloader, on NMT reset node or a request for the bootloader.
fn restart() -> ! {
    defmt::info!("restart");
    cortex_m::peripheral::SCB::sys_reset()
}

/// One flash a second.
fn blink(now: Instant) -> bool {
    now.0 % 1_000_000 < 100_000
}

/// Notes the parameters of the protocol. Not inlined, because they take half a kibibyte of the stack of each caller.
#[inline(never)]
fn note_parameters(place: &mut Option<Parameters>, protocol: &Protocol) {
    *place = Some(protocol.parameters());
}
