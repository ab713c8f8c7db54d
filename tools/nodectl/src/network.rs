//! The shared access of the services to a bus: waiting for one frame without losing the others, and opening the bus
//! again.

use std::collections::{BTreeMap, VecDeque};
use std::io::ErrorKind;

use canopen::client::heartbeat::Heartbeat;
use canopen::client::{Service, Step, Taken};
use canopen::nmt::State;
use canopen::{Duration, Frame, Instant, NodeId};

use crate::bus::{Bus, BusError, Received};
use crate::lift::is_fixed;
use crate::other_clients::OtherClients;
use crate::sdo::Channel;
use crate::steadiness::Steadiness;

/// The number of frames that are kept for later; the oldest frames are dropped first.
const KEPT: usize = 4096;

/// The number of frames that a service gets between two of its steps. The limit keeps a flooded bus from delaying the
/// deadline.
const AT_ONCE: usize = 256;

/// The pause between the last frame of another client's transfer and a request. A client that has more to ask asks
/// sooner.
const PAUSE: Duration = Duration::from_millis(30);
/// How long to wait for such a pause. Clients that never pause have to let others in between two transfers.
const WITHOUT_PAUSE: Duration = Duration::from_millis(1000);

/// The first byte of an SDO abort message (CiA 301, 7.2.4.3.17).
const ABORT: u8 = 0x80;

/// The number of frames in a log; later frames are not logged.
const LOGGED: usize = 100_000;

/// A frame of the log.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Logged {
    /// The frame.
    pub frame: Frame,
    /// Time of the frame on the bus, by the clock of the adapter. For a frame that this program has sent, by the clock
    /// of this computer.
    pub at: Instant,
    /// Time of receiving or sending, by the clock of this computer.
    pub here: Instant,
    /// Whether this program has sent the frame.
    pub is_sent: bool,
}

/// The messages received from a node, whether it answers requests or not.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Heard {
    /// The state in the newest heartbeat or boot-up message; `None` without one.
    pub state: Option<State>,
    /// Whether a message has come that no lift device of another node-ID sends: the CAN-IDs of CiA 417 are fixed.
    pub is_sure: bool,
}

/// Whether a transfer may begin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Gate {
    /// The transfer may begin.
    Open,
    /// The transfer may begin now, after a wait.
    Waited,
    /// The transfer is no longer wanted.
    Closed,
}

/// A bus that can be opened again after it is lost.
pub struct Network {
    opener: Box<dyn FnMut() -> Result<Box<dyn Bus>, BusError>>,
    bus: Box<dyn Bus>,
    kept: VecDeque<Received>,
    /// Time stamp of the newest frame, and the time of its arrival.
    newest: Option<(Instant, Instant)>,
    log: Option<Vec<Logged>>,
    steadiness: Steadiness,
    others: OtherClients,
    heard: BTreeMap<NodeId, Heard>,
    gate: Box<dyn FnMut() -> Gate>,
    /// The time that was spent at the gate.
    waited: Duration,
    /// When the bus was opened.
    opened: Instant,
}

impl Network {
    /// Opens the bus by `opener`, which is called again for each [`reopen`](Network::reopen).
    ///
    /// # Errors
    /// The errors of `opener`.
    pub fn open(
        mut opener: impl FnMut() -> Result<Box<dyn Bus>, BusError> + 'static,
    ) -> Result<Network, BusError> {
        let bus = opener()?;
        let opened = bus.now();
        let (opener, kept) = (Box::new(opener), VecDeque::new());
        Ok(Network {
            opener,
            bus,
            kept,
            newest: None,
            log: None,
            steadiness: Steadiness::default(),
            others: OtherClients::default(),
            heard: BTreeMap::new(),
            gate: Box::new(|| Gate::Open),
            waited: Duration(0),
            opened,
        })
    }

    /// Calls `gate` before each transfer. The gate may wait for the transfers of other clients.
    pub fn set_gate(&mut self, gate: impl FnMut() -> Gate + 'static) {
        self.gate = Box::new(gate);
    }

    /// Passes the gate. Frames that have come while the gate was closed belong to the transfers of other clients.
    ///
    /// # Errors
    /// The gate has been closed for good, or the bus is lost.
    pub fn pass(&mut self) -> Result<(), BusError> {
        let before = self.now();
        match (self.gate)() {
            Gate::Open => {}
            Gate::Waited => {
                for _ in 0..KEPT {
                    if self.fetch(self.now())?.is_none() {
                        break;
                    }
                }
                self.waited.0 += self.now().0.saturating_sub(before.0);
            }
            Gate::Closed => return Err(BusError::Lost(ErrorKind::Interrupted.into())),
        }
        Ok(())
    }

    /// The time of this computer without the time that was spent at the gate, for deadlines of several transfers.
    #[must_use]
    pub fn own_time(&self) -> Instant {
        Instant(self.now().0.saturating_sub(self.waited.0))
    }

    /// Opens the bus again. The kept frames of the old bus are dropped.
    ///
    /// # Errors
    /// The errors of the opener; the network is unchanged then.
    pub fn reopen(&mut self) -> Result<(), BusError> {
        self.bus = (self.opener)()?;
        self.kept.clear();
        (self.newest, self.opened) = (None, self.bus.now());
        Ok(())
    }

    /// The time of this computer.
    #[must_use]
    pub fn now(&self) -> Instant {
        self.bus.now()
    }

    /// The time on the bus by the clock of the adapter: the newest time stamp and the time since then. `None` before
    /// the first frame.
    #[must_use]
    pub fn bus_time(&self) -> Option<Instant> {
        self.newest.map(|(at, arrival)| at + Duration(self.now().0.saturating_sub(arrival.0)))
    }

    /// The time stamp of the newest frame; `None` before the first frame.
    #[must_use]
    pub fn newest_stamp(&self) -> Option<Instant> {
        self.newest.map(|(at, _)| at)
    }

    /// The state in the newest heartbeat of a node, among the kept frames.
    #[must_use]
    pub fn last_state(&self, node: NodeId) -> Option<State> {
        let heartbeats = self.kept.iter().rev().filter_map(|received| Heartbeat::parse(&received.frame));
        heartbeats.filter(|heard| heard.node == node).map(|heard| heard.state).next()
    }

    /// The messages received from a node since the bus was opened: heartbeats, emergencies, and PDOs of the pre-defined connection
    /// set. `None` where nothing was heard.
    #[must_use]
    pub fn heard(&self, node: NodeId) -> Option<Heard> {
        self.heard.get(&node).copied()
    }

    /// All nodes that were heard.
    pub fn all_heard(&self) -> impl Iterator<Item = (NodeId, Heard)> {
        self.heard.iter().map(|(node, heard)| (*node, *heard))
    }

    /// The oldest kept frame.
    pub fn take_kept(&mut self) -> Option<Received> {
        self.kept.pop_front()
    }

    /// Sends a frame.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.bus.send(frame)?;
        let now = self.bus.now();
        self.write_down(Logged { frame: *frame, at: now, here: now, is_sent: true });
        Ok(())
    }

    /// The SDO channel that transfers with a node use.
    #[must_use]
    pub fn channel(&self, node: NodeId) -> Channel {
        self.others.channel(node)
    }

    /// Sets the SDO channel for transfers with a node, until the node boots; `None` for the default channel.
    pub fn set_channel(&mut self, node: NodeId, channel: Option<Channel>) {
        self.others.set_channel(node, channel);
    }

    /// Waits until no transfer of another client runs on the SDO channel of a node. Returns `false` when one still runs
    /// at the deadline.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn wait_for_turn(&mut self, node: NodeId, deadline: Instant) -> Result<bool, BusError> {
        for _ in 0..AT_ONCE {
            let Some(received) = self.fetch(self.now())? else { break };
            self.keep(received);
        }
        let begin = self.now();
        let pause_until = begin + WITHOUT_PAUSE;
        loop {
            let now = self.now();
            // Before the first request, the bus is listened to: a transfer may run already.
            let silence =
                self.others.quiet(node, now).unwrap_or(Duration(now.0.saturating_sub(self.opened.0)));
            let left = PAUSE.0.saturating_sub(silence.0);
            let is_busy = self.others.is_busy(node, now);
            // Without an answer, the frames may be the segments of a block whose begin was not heard.
            let has_waited =
                now >= pause_until && self.others.heard(node).is_some_and(|heard| heard.answer >= begin);
            if !is_busy && (left == 0 || has_waited) {
                return Ok(true);
            }
            if now >= deadline {
                return Ok(!is_busy);
            }
            let wake = now + Duration(left.max(1000));
            if let Some(received) = self.fetch(wake.min(deadline))? {
                self.keep(received);
            }
        }
    }

    /// The node of an SDO frame, whether its channel is an additional one, and the frame with its CAN-ID on the default
    /// channel; `None` for any other frame.
    pub(crate) fn sdo(&self, frame: &Frame) -> Option<(NodeId, bool, Frame)> {
        self.others.sdo(frame)
    }

    /// Whether another client has sent a request on the SDO channel of a node since an instant.
    pub(crate) fn has_other_request_since(&self, node: NodeId, begin: Instant) -> bool {
        self.others.heard(node).is_some_and(|heard| heard.request >= begin)
    }

    /// Begins a log of all frames, sent and received. A former log is dropped.
    pub fn begin_log(&mut self) {
        self.log = Some(Vec::new());
        self.steadiness = Steadiness::since(self.newest);
    }

    /// The longest time since [`begin_log`](Network::begin_log) for which this computer, the adapter or a simulated bus
    /// stood still: frames arrived that much later than others after their time stamps, or a pause was that much longer.
    #[must_use]
    pub fn stall(&self) -> Duration {
        self.steadiness.stall()
    }

    /// The frames since [`begin_log`](Network::begin_log), in their order.
    #[must_use]
    pub fn log(&self) -> &[Logged] {
        self.log.as_deref().unwrap_or_default()
    }

    /// Ends the log.
    pub fn end_log(&mut self) {
        self.log = None;
    }

    fn write_down(&mut self, logged: Logged) {
        if let Some(log) = self.log.as_mut().filter(|log| log.len() < LOGGED) {
            log.push(logged);
        }
    }

    /// The next frame; `None` when none has come until then. The frames that [`wait`](Network::wait) has kept come
    /// first.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        match self.kept.pop_front() {
            Some(received) => Ok(Some(received)),
            None => self.fetch(until),
        }
    }

    /// Drops the kept frames.
    pub fn forget(&mut self) {
        self.kept.clear();
    }

    /// The first new frame that `pick` accepts; `None` when none has come until then. The other frames are kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn wait<T>(
        &mut self,
        until: Instant,
        mut pick: impl FnMut(&Frame) -> Option<T>,
    ) -> Result<Option<T>, BusError> {
        while let Some(received) = self.fetch(until)? {
            if let Some(picked) = pick(&received.frame) {
                return Ok(Some(picked));
            }
            self.keep(received);
            // A busy bus must not delay the deadline.
            if self.now() >= until {
                break;
            }
        }
        Ok(None)
    }

    /// Runs a service of the crate `canopen` to its end. Frames that the service does not use are kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn run<S: Service>(&mut self, service: &mut S) -> Result<S::Output, BusError> {
        self.run_with(service, |_| ())
    }

    /// Runs a service to its end. `progress` is called with the service after each step.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn run_with<S: Service>(
        &mut self,
        service: &mut S,
        mut progress: impl FnMut(&S),
    ) -> Result<S::Output, BusError> {
        loop {
            self.hand_over(service)?;
            let step = service.next(self.now());
            progress(service);
            match step {
                Step::Send(frame) if self.would_end_another(&frame) => {}
                Step::Send(frame) => self.send(&frame)?,
                Step::Wait(until) => {
                    if let Some(received) = self.fetch(until)? {
                        self.offer(service, received);
                    }
                }
                Step::Done(output) => return Ok(output),
            }
        }
    }

    /// Whether a frame is an abort message that would end the transfer of another client: it has begun in the same moment.
    fn would_end_another(&self, frame: &Frame) -> bool {
        frame.data().first() == Some(&ABORT) && self.others.has_transfer(frame.id(), self.now())
    }

    /// Passes the frames that have arrived to the service.
    fn hand_over(&mut self, service: &mut impl Service) -> Result<(), BusError> {
        for _ in 0..AT_ONCE {
            let Some(received) = self.fetch(self.now())? else { break };
            self.offer(service, received);
        }
        Ok(())
    }

    fn offer(&mut self, service: &mut impl Service, received: Received) {
        if service.on_frame(&received.frame, self.now()) == Taken::Ignored {
            self.keep(received);
        }
    }

    fn keep(&mut self, received: Received) {
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back(received);
    }

    /// Lets time pass; the frames that arrive are kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn pause(&mut self, time: Duration) -> Result<(), BusError> {
        let until = self.now() + time;
        self.wait(until, |_| None::<()>)?;
        self.steadiness.on_pause(until, self.now());
        Ok(())
    }

    /// Lets time pass until the SDO server of a node has sent nothing for the time `quiet`, for `limit` at most. The frames that
    /// arrive are kept.
    ///
    /// # Errors
    /// The bus is lost.
    pub(crate) fn wait_for_silence(
        &mut self,
        node: NodeId,
        quiet: Duration,
        limit: Duration,
    ) -> Result<(), BusError> {
        let (response, end) = (self.channel(node).response, self.now() + limit);
        while self.now() < end {
            let until = self.now() + quiet;
            if self.wait(until, |frame| (frame.id() == response).then_some(()))?.is_none() {
                break;
            }
        }
        Ok(())
    }

    fn hear(&mut self, frame: &Frame) {
        let id = frame.id();
        let node = u8::try_from(id & 0x7F).ok().and_then(NodeId::new);
        let is_sender = matches!(id, 0x081..=0x0FF | 0x181..=0x1FF | 0x281..=0x2FF | 0x381..=0x3FF | 0x481..=0x4FF)
            || (matches!(id, 0x701..=0x77F) && !frame.is_remote());
        if let Some(node) = node.filter(|_| is_sender) {
            let heard = self.heard.entry(node).or_default();
            heard.is_sure |= !is_fixed(id);
            heard.state = Heartbeat::parse(frame).map(|heartbeat| heartbeat.state).or(heard.state);
        }
    }

    fn fetch(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        let received = self.bus.receive(until)?;
        if let Some(received) = received {
            let here = self.bus.now();
            self.newest = Some((received.at, here));
            self.steadiness.on_frame(received.at, here);
            self.hear(&received.frame);
            self.others.on_frame(&received.frame, here);
            // After a boot, an additional SDO server may be off again.
            if let Some(Heartbeat { node, state: State::Initialising }) = Heartbeat::parse(&received.frame) {
                self.others.set_channel(node, None);
            }
            self.write_down(Logged { frame: received.frame, at: received.at, here, is_sent: false });
        }
        Ok(received)
    }
}
