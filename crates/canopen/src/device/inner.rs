//! The device behind the SDO server and the LSS slave: values, NMT state, heartbeat, PDO, SYNC, EMCY, the heartbeats of
//! other nodes and stored parameters.

use super::pdos::low_half;
use super::state::{Pending, SELF_START, Scope};
use super::{Action, Application, Definition, STALE, store};
use crate::array::Array;
use crate::dictionary::{Dictionary, Entry, Field, Group, Groups, Services, little_endian};
use crate::emcy::Fault;
use crate::nmt::State;
use crate::pdo::{Choices, Links, ProcessContext, Rpdo, Scanner};
use crate::transmit::Context;
use crate::{CanId, NodeId, Span, Tick, Transmit, emcy, heartbeat, sync, time_stamp};

/// A device without its SDO server and its LSS slave, which act on it.
// In this order, a short instruction reaches most fields: bytes and words come first, arrays last.
#[repr(C)]
pub struct Inner<D: Definition> {
    pub(super) state: State,
    /// `None` for a device that waits for a node-ID from LSS.
    pub(super) node_id: Option<NodeId>,
    pub(super) is_bus_off: bool,
    /// Whether any TPDO sends events.
    pub(super) sends_events: bool,
    /// The groups whose newest stored values could not be loaded.
    pub(super) damage: store::Damage,
    pub(super) pending: Pending,
    pub(super) jobs: store::Jobs,
    pub(super) dictionary: &'static Dictionary,
    /// Cached next deadlines. `STALE` after a change that may have moved a deadline.
    pub(super) process_due: Tick,
    pub(super) services_due: Tick,
    /// The first PDOs of the chains.
    pub(super) first_tpdos: Links,
    pub(super) first_rpdos: Links,
    /// The lowest five bits of the CAN-IDs of all valid RPDOs, as a set of 32 bits. Most frames for other nodes are not
    /// in the set and need no further check.
    pub(super) rpdo_filter: u32,
    /// The RPDO that takes the multiplexed PDOs of all nodes: its CAN-ID and position in `rpdos`.
    pub(super) all_nodes: Option<(CanId, u16)>,
    /// The groups whose defaults will be in use after the next reset that loads them (1011h).
    pub(super) restored: Groups,
    pub(super) heartbeat: heartbeat::Producer,
    pub(super) sync: sync::Consumer,
    pub(super) sync_producer: sync::Producer,
    pub(super) time_stamp: time_stamp::Service,
    pub(super) guarding: heartbeat::Guarding,
    pub(super) emcy: emcy::Producer,
    pub(super) watches: heartbeat::Consumer<D::Heartbeats>,
    pub(super) application: D::Application,
    /// The end of the faults that are events: [`Inner::report`].
    pub(super) quiet_at: Tick,
    pub(super) tpdos: D::Tpdos,
    pub(super) rpdos: D::Rpdos,
    pub(super) scanner: Scanner<D::Scanned>,
    pub(super) image: D::Image,
}

impl<D: Definition> Choices for Inner<D> {
    const SENDS_EVENTS: bool = D::Application::SENDS_EVENTS;
    const THRESHOLDS: bool = D::Application::THRESHOLDS;
    const BUS_SHARE: bool = D::Application::BUS_SHARE;
}

impl<D: Definition> Inner<D> {
    /// The active faults of the application are a set of 32 bits.
    ///
    /// ```compile_fail
    /// struct Plant;
    ///
    /// impl canopen::Application for Plant {
    ///     const CONDITIONS: &'static [canopen::Condition] = &[canopen::Condition::new(0x1000); 33];
    /// }
    ///
    /// const ROWS: &[canopen::dictionary::Object] = &[canopen::objects::device_type(0)];
    /// static DICTIONARY: canopen::dictionary::Dictionary = canopen::dictionary!(ROWS);
    ///
    /// let _: canopen::device!(Plant, ROWS) = canopen::Device::new(&DICTIONARY, None, Plant);
    /// ```
    const CONDITIONS_FIT: () =
        assert!(D::Application::CONDITIONS.len() <= 32, "an application has at most 32 conditions");

    /// A device that has not started.
    pub(super) fn new(
        dictionary: &'static Dictionary,
        node_id: Option<NodeId>,
        application: D::Application,
    ) -> Inner<D> {
        let () = Self::CONDITIONS_FIT;
        let emcy = emcy::Producer::new(D::Application::CONDITIONS, application.register_bits());
        Inner {
            dictionary,
            node_id,
            state: State::Initialising,
            process_due: Tick::NEVER,
            services_due: Tick::NEVER,
            quiet_at: Tick::NEVER,
            heartbeat: heartbeat::Producer::new(),
            guarding: heartbeat::Guarding::new(),
            pending: Pending::new(),
            application,
            watches: heartbeat::Consumer::new(),
            sync: sync::Consumer::new(),
            sync_producer: sync::Producer::new(),
            time_stamp: time_stamp::Service::new(),
            emcy,
            tpdos: D::Tpdos::NEW,
            rpdos: D::Rpdos::NEW,
            rpdo_filter: 0,
            scanner: Scanner::new(),
            all_nodes: None,
            sends_events: false,
            first_tpdos: Links::END,
            first_rpdos: Links::END,
            jobs: store::Jobs::new(),
            damage: store::Damage::NONE,
            restored: Groups::NONE,
            is_bus_off: false,
            image: D::Image::NEW,
        }
    }

    /// The epoch of the clock has moved.
    pub(super) fn shift(&mut self, by: Span) {
        self.process_due.shift(by);
        self.services_due.shift(by);
        if Self::has(Services::FAULTS) {
            self.quiet_at.shift(by);
        }
        self.heartbeat.shift(by);
        if Self::has(Services::GUARDING) {
            self.guarding.shift(by);
        }
        if Self::has(Services::HEARTBEAT_CONSUMER) {
            self.watches.shift(by);
        }
        if Self::has(Services::SYNC) {
            self.sync.shift(by);
        }
        if Self::has(Services::SYNC_PRODUCER) {
            self.sync_producer.shift(by);
        }
        if Self::has(Services::EMCY) {
            self.emcy.shift(by);
        }
        self.tpdos.as_mut().iter_mut().for_each(|tpdo| tpdo.shift(by));
        self.rpdos.as_mut().iter_mut().for_each(|rpdo| rpdo.shift(by));
        if Self::has(Services::MULTIPLEXED_TPDO) {
            self.scanner.shift(by);
        }
    }

    /// Whether the device has a service. The compiler removes the code of any other.
    pub(super) const fn has(service: Services) -> bool {
        D::SERVICES.contains(service)
    }

    /// Whether the device has process data, or sends or receives SYNCs or time stamps.
    pub(super) const fn has_process() -> bool {
        let pdos = Self::has(Services::TPDO) || Self::has(Services::RPDO);
        pdos || Self::has(Services::SYNC) || Self::has(Services::SYNC_PRODUCER) || Self::has(Services::TIME)
    }

    pub(super) fn is_initialising(&self) -> bool {
        self.state == State::Initialising
    }

    /// The CAN-ID of a service of this device. Without a node-ID, the CAN-ID for node-ID 0, which no device uses.
    pub(super) fn service(&self, function: u16) -> CanId {
        CanId::of_service(function, self.node_id.map_or(0, NodeId::get))
    }

    /// Makes the services due at this instant, or earlier.
    pub(super) fn serve_until(&mut self, due: Tick) {
        self.services_due = self.services_due.min(due);
    }

    /// Asks the caller for an action.
    pub(super) fn ask(&mut self, action: Action) {
        self.pending.ask(action);
    }

    /// An integer of at most 32 bits; 0 where the dictionary has no such entry.
    #[inline(never)]
    pub(super) fn number(&self, index: u16, sub: u8) -> u32 {
        self.number_or(index, sub, 0)
    }

    pub(super) fn number_or(&self, index: u16, sub: u8, absent: u32) -> u32 {
        self.dictionary.find(index, sub).map_or(absent, |entry| self.word(entry.field))
    }

    /// The default value of an integer of at most 32 bits, including the node-ID where the default is relative to it.
    pub(super) fn default_number(&self, entry: &Entry) -> u32 {
        self.dictionary.default_number(entry, self.node_id)
    }

    #[inline(never)]
    pub(super) fn word(&self, field: Field) -> u32 {
        little_endian(field.get(self.image.as_ref()))
    }

    /// Changes the NMT state. Initialising has no heartbeat, and no boot-up message before [`Device::start`](super::Device).
    #[inline(never)]
    pub(super) fn enter(&mut self, state: State) {
        if state == State::Initialising {
            self.heartbeat = heartbeat::Producer::new();
        }
        if state == self.state {
            return;
        }
        let had_services = self.state.has_services();
        (self.state, self.services_due) = (state, STALE);
        if Self::has(Services::SYNC_PRODUCER) && had_services != state.has_services() {
            self.restart_sync();
        }
        if Self::has_process() {
            self.start_or_stop_pdos(state);
        }
        self.application.state(state, self.image.as_mut());
    }

    /// The NMT state has changed to `state`.
    fn start_or_stop_pdos(&mut self, state: State) {
        self.sync.stop();
        for place in 0..self.tpdos.as_ref().len() {
            if let Some(tpdo) = self.tpdos.as_mut().get_mut(place) {
                if state == State::Initialising {
                    tpdo.forget_sent();
                }
                if state.has_pdos() { tpdo.start() } else { tpdo.stop() }
            }
            self.begin_events(place);
        }
        self.rpdos.as_mut().iter_mut().for_each(Rpdo::stop);
        if Self::has(Services::MULTIPLEXED_TPDO) {
            if state == State::Initialising {
                self.scanner.forget_sent();
            }
            if state.has_pdos() { self.scanner.start() } else { self.scanner.stop() }
        }
        self.process_due = STALE;
    }

    /// Sets objects to their values after a reset: all objects, or the communication objects only.
    pub(super) fn load_values(&mut self, everything: bool) {
        self.load_defaults(if everything { Scope::Everything } else { Scope::Communication });
        if !Self::has(Services::FAULTS) {
            return;
        }
        self.load_stored(Group::Communication);
        if everything {
            self.load_stored(Group::Application);
            self.load_stored(Group::Calibration);
            if Self::has(Services::OWN_GROUPS) {
                for group in Group::OWN {
                    self.load_stored(group);
                }
            }
        }
    }

    /// Hands all protocols their parameters from the dictionary.
    pub(super) fn configure(&mut self, now: Tick) {
        if Self::has(Services::SYNC) {
            self.configure_sync(now);
        }
        if Self::has(Services::TIME) {
            self.configure_time();
        }
        if Self::has(Services::EMCY) {
            let _ = self.emcy.configure(self.number_or(0x1014, 0, u32::MAX));
            self.emcy.set_inhibit(low_half(self.number(0x1015, 0)), now);
            let depth = self.dictionary.find(0x1003, 0).map_or(0, |count| count.series.entries - 1);
            self.emcy.set_history_depth(depth.min(emcy::HISTORY));
        }
        if Self::has(Services::HEARTBEAT_CONSUMER) {
            self.configure_watches(now);
        }
        if Self::has(Services::GUARDING) {
            self.configure_guarding(now);
            self.guarding.restart();
        }
        if Self::has_process() {
            self.configure_pdos(now);
        }
        if Self::has(Services::FAULTS) {
            self.configure_faults(now);
        }
        if Self::has(Services::SELF_START) && self.number(0x1F80, 0) == SELF_START {
            self.pending.next_state = Some(State::Operational);
        }
    }

    /// Sends the process data that is due.
    #[inline]
    pub(super) fn send_process(&mut self, context: &mut ProcessContext<'_, impl Transmit, Self>) {
        if context.now >= self.process_due {
            self.run_process(context);
        }
    }

    /// Checks for due work other than SDO, LSS and the heartbeat of the device.
    #[inline(never)]
    pub(super) fn poll_errors(&mut self, context: &mut Context<'_, impl Transmit>) {
        while Self::has(Services::HEARTBEAT_CONSUMER)
            && let Some(change) = self.watches.expire(context.now)
        {
            self.on_watch(change, context.now);
        }
        if Self::has(Services::GUARDING) && self.guarding.expire(context.now) {
            self.raise(Fault::LifeGuard, context.now);
        }
        if Self::has(Services::FAULTS) && context.now >= self.quiet_at {
            self.end_events(context.now);
        }
        if Self::has(Services::EMCY) && self.state.has_services() {
            self.emcy.poll(D::Application::LISTS_DETAIL, context);
        }
        if Self::has(Services::FAULTS) {
            self.react();
        }
    }

    /// The next deadline of `poll_errors`.
    pub(super) fn errors_due(&self) -> Tick {
        let is_sent = Self::has(Services::EMCY) && self.state.has_services();
        let emcy = if is_sent { self.emcy.due() } else { Tick::NEVER };
        let due = if Self::has(Services::FAULTS) { emcy.min(self.quiet_at) } else { emcy };
        let due = if Self::has(Services::GUARDING) { due.min(self.guarding.due()) } else { due };
        if Self::has(Services::HEARTBEAT_CONSUMER) { due.min(self.watches.due()) } else { due }
    }
}
