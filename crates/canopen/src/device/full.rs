//! The outer device: PDO, SYNC, EMCY, the heartbeats of other nodes and stored parameters around the inner one.

use super::basic::Basic;
use super::body::Body;
use super::pdos::low_half;
use super::state::SELF_START;
use super::{Application, Job, STALE, store};
use crate::dictionary::{Dictionary, Entry, Group, Groups, Rule, Services};
use crate::lss::Configuration;
use crate::nmt::State;
use crate::pdo::{Links, Rpdo, Scanner, Tpdo};
use crate::sdo::Abort;
use crate::transmit::{Context, ProcessContext};
use crate::{CanId, Frame, Instant, NodeId, Transmit, emcy, heartbeat, sync};

/// A complete device without its services. The parameters are those of [`Device`](super::Device).
#[derive(Debug)]
pub struct Full<
    A,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16,
> {
    pub(super) basic: Basic<A, [u8; N]>,
    pub(super) watches: heartbeat::Consumer<W>,
    pub(super) sync: sync::Consumer,
    pub(super) emcy: emcy::Producer,
    pub(super) tpdos: [Tpdo; T],
    pub(super) rpdos: [Rpdo; R],
    /// The lowest five bits of the CAN-IDs of all valid RPDOs, as a set of 32 bits. Most frames for other nodes are not
    /// in the set and need no further check.
    pub(super) rpdo_filter: u32,
    pub(super) scanner: Scanner<M>,
    /// The RPDO that takes the multiplexed PDOs of all nodes: its CAN-ID and position in `rpdos`.
    pub(super) all_nodes: Option<(CanId, u16)>,
    /// Whether any TPDO sends events.
    pub(super) sends_events: bool,
    /// The first PDOs of the chains.
    pub(super) first_tpdos: Links,
    pub(super) first_rpdos: Links,
    pub(super) jobs: store::Jobs,
    /// The groups whose stored values could not be loaded: the defaults are in use.
    pub(super) lost: Groups,
    /// The groups whose newest stored values could not be loaded: the values of the save before are in use.
    pub(super) older: Groups,
    pub(super) is_bus_off: bool,
}

impl<
    A: Application,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16,
> Body for Full<A, N, T, R, W, M, S>
{
    type Application = A;
    type Image = [u8; N];

    const HAS_PDOS: bool = true;
    /// Free places for all PDOs of a SYNC, a heartbeat and an EMCY.
    const RESERVED_ROOM: usize = 10;

    fn new(dictionary: &'static Dictionary, node_id: Option<NodeId>, application: A) -> Self {
        let emcy = emcy::Producer::new(A::CONDITIONS, application.register_bits());
        Full {
            basic: Basic::new(dictionary, node_id, application),
            watches: heartbeat::Consumer::new(),
            sync: sync::Consumer::new(),
            emcy,
            tpdos: core::array::from_fn(|_| Tpdo::new()),
            rpdos: core::array::from_fn(|_| Rpdo::new()),
            rpdo_filter: 0,
            scanner: Scanner::new(),
            all_nodes: None,
            sends_events: false,
            first_tpdos: Links::END,
            first_rpdos: Links::END,
            jobs: store::Jobs::new(),
            lost: Groups::NONE,
            older: Groups::NONE,
            is_bus_off: false,
        }
    }

    fn basic(&self) -> &Basic<A, [u8]> {
        &self.basic
    }

    fn image(&self) -> &[u8; N] {
        &self.basic.image
    }

    fn basic_mut(&mut self) -> &mut Basic<A, [u8]> {
        &mut self.basic
    }

    fn entered(&mut self, state: State) {
        self.sync.stop();
        for place in 0..T {
            if let Some(tpdo) = self.tpdos.get_mut(place) {
                if state == State::Initialising {
                    tpdo.forget_sent();
                }
                if state.has_pdos() { tpdo.start() } else { tpdo.stop() }
            }
            self.begin_events(place);
        }
        self.rpdos.iter_mut().for_each(Rpdo::stop);
        if M > 0 {
            if state == State::Initialising {
                self.scanner.forget_sent();
            }
            if state.has_pdos() { self.scanner.start() } else { self.scanner.stop() }
        }
        self.basic.process_due = STALE;
    }

    fn load_values(&mut self, everything: bool) {
        self.load_parameters(everything);
    }

    fn configure(&mut self, now: Instant) {
        if Self::has(Services::SYNC) {
            self.configure_sync(now);
        }
        if Self::has(Services::EMCY) {
            let _ = self.emcy.configure(self.basic().number_or(0x1014, 0, emcy::OFF));
            self.emcy.set_inhibit(low_half(self.basic().number(0x1015, 0)), now);
        }
        self.configure_watches(now);
        self.configure_pdos(now);
        if Self::has(Services::EMCY) {
            self.emcy.restart(now);
        } else {
            self.emcy.restart_silently();
        }
        self.report_stored(now);
        self.update_error_register();
        if self.basic().number(0x1F80, 0) == SELF_START {
            self.basic.pending.next_state = Some(State::Operational);
        }
    }

    fn on_pdo_frame(&mut self, frame: &Frame, context: &mut ProcessContext<'_, impl Transmit>) {
        self.take_pdo_frame(frame, context);
    }

    fn send_process(&mut self, context: &mut ProcessContext<'_, impl Transmit>) {
        if context.now >= self.basic.process_due {
            self.run_process(context);
        }
    }

    fn on_heartbeat(&mut self, frame: &Frame, now: Instant) {
        if W > 0 {
            self.take_heartbeat(frame, now);
        }
    }

    #[inline(never)]
    fn poll_errors(&mut self, context: &mut Context<'_, impl Transmit>) {
        while W > 0
            && let Some(change) = self.watches.expire(context.now)
        {
            self.on_watch(change, context.now);
        }
        if Self::has(Services::EMCY) && self.basic.state.has_services() {
            self.emcy.poll(context);
        }
        self.react();
    }

    fn errors_due(&self) -> Instant {
        let is_sent = Self::has(Services::EMCY) && self.basic.state.has_services();
        let emcy = if is_sent { self.emcy.due() } else { Instant::NEVER };
        if W > 0 { emcy.min(self.watches.due()) } else { emcy }
    }

    fn computed(&self, entry: &Entry) -> Result<&[u8], Abort> {
        let history = self.emcy.history();
        match entry.rule() {
            Rule::ErrorCount => Ok(core::slice::from_ref(history.count())),
            _ => Ok(history.error(entry.sub()).ok_or(Abort::NoData)?),
        }
    }

    fn admit(&mut self, entry: &Entry, value: u32) -> Result<(), Abort> {
        self.admit_value(entry, value)
    }

    fn value_written(&mut self, entry: &Entry, value: u32, now: Instant) {
        self.apply_value(entry, value, now);
    }

    fn check_store(&self, entry: &Entry) -> Result<Option<Job>, Abort> {
        self.check_store_at_once(entry)
    }

    fn store_at_once(&mut self, job: Job) -> Result<(), Abort> {
        self.begin_deferred(job)
    }

    fn store_configuration(&mut self, configuration: Configuration) -> bool {
        self.begin_configuration(configuration)
    }

    fn take_deferred(&mut self) -> bool {
        self.jobs.take_deferred()
    }

    fn watched_ids(&self) -> impl Iterator<Item = CanId> {
        self.watches.ids()
    }
}

impl<
    A: Application,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
    const S: u16,
> Full<A, N, T, R, W, M, S>
{
    /// Whether the rows ask for a service. The compiler removes the code of any other.
    pub(super) const fn has(service: Services) -> bool {
        Services::from_bits(S).contains(service)
    }

    fn load_parameters(&mut self, everything: bool) {
        let scope =
            if everything { super::state::Scope::Everything } else { super::state::Scope::Communication };
        self.basic_mut().load_defaults(scope);
        self.load_stored(Group::Communication);
        if everything {
            self.load_stored(Group::Application);
            self.load_stored(Group::Calibration);
        }
    }
}
