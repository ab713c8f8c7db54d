//! The protocol half: the CANopen device with everything it owns.

use canopen::nmt::State;
use canopen::{Action, CanId, Device, Frame, Instant, Job, NodeId, Transmit};
use profiles::board::Outputs;
use profiles::{Parameters, ROOM, Snapshot};

use crate::application::NodeApplication;
use crate::faults::Shown;
use crate::{Next, Setup};

/// The sample of this millisecond may have been taken, and the next one may have begun, before there were new parameters.
const OLDER_SAMPLES: u8 = 3;

/// The CANopen device of one node. The process-data task and the services task share it; each locks it for one call. Every
/// call returns what follows from it: see [`Next`].
#[derive(Debug)]
pub struct Protocol {
    pub(crate) device: canopen::device!(NodeApplication, room: ROOM),
    /// As last published: most samples change nothing.
    pub(crate) shown: Shown,
    /// The job of the last `Action::Store`.
    pub(crate) job: Option<Job>,
    /// Samples that may still come from before the parameters that hold now.
    pub(crate) older_samples: u8,
}

impl Protocol {
    /// A node that has not started: it is silent and hears nothing until `start`.
    #[must_use]
    pub fn new(setup: &Setup) -> Protocol {
        let dictionary = setup.personality.dictionary();
        let device =
            Device::new(dictionary, setup.node_id, NodeApplication::new(setup)).with_bit_rate(setup.bit_rate);
        Protocol { device, shown: Shown::default(), job: None, older_samples: 0 }
    }

    /// Initialises what the pending reset covers, then boots up. To be called once the bus is ready,
    /// and again for `Action::ResetCommunication`.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let next = self.device.start(now, out);
        // The error register is known only now.
        self.device.show(|application, image| application.show_flags(image));
        self.note(next)
    }

    /// Keeps the job that is to be done, for `take_job`, and takes note of new parameters.
    pub(crate) fn note(&mut self, next: Next) -> Next {
        if next.parameters {
            self.older_samples = OLDER_SAMPLES;
        }
        if let Some(Action::Store(job)) = next.action {
            self.job = Some(job);
        }
        next
    }

    /// The node-ID in use; `None` while it waits for LSS to give it one.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.device.node_id()
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> State {
        self.device.state()
    }

    /// Whether the node does what it is for: it has said its boot-up message, and values were measured.
    #[must_use]
    pub fn is_at_work(&self) -> bool {
        self.state() != State::Initialising && self.device.application().has_measured()
    }

    /// A frame of FIFO 0: NMT, SYNC, RPDO, or a remote request for a TPDO.
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.note_master(frame);
        let next = self.device.on_process_frame(frame, now, out);
        self.note(next)
    }

    /// A frame of FIFO 1: everything else.
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.note_master(frame);
        let next = self.device.on_service_frame(frame, now, out);
        self.note(next)
    }

    /// The place of the values of the last millisecond, for [`publish`](Protocol::publish): who measures writes them
    /// there, or copies them once.
    pub fn snapshot_mut(&mut self) -> &mut Snapshot {
        &mut self.device.application_mut().snapshot
    }

    /// Takes the values of the last millisecond into the dictionary and sends what their change triggers, and what is due
    /// of process data. Before the measurement has parameters there are none.
    pub fn publish(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let snapshot = &self.device.application().snapshot;
        if matches!(snapshot, Snapshot::Nothing) {
            return self.device.poll_process(now, out);
        }
        self.older_samples = self.older_samples.saturating_sub(1);
        let shown = Shown::of(snapshot);
        if self.shown != shown {
            self.follow_faults(shown, now);
        }
        self.device.publish(now, out, NodeApplication::show_values)
    }

    /// Does what is due of PDO and SYNC timers.
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        self.device.poll_process(now, out)
    }

    /// Does what is due of heartbeat, SDO and EMCY.
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let next = self.device.poll_services(now, out);
        self.note(next)
    }

    /// The parameters for `Measurement::apply`: new ones when [`Next::parameters`] says so.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        self.device.application().profile.parameters(self.device.image())
    }

    /// The outputs of the board. To be asked for after each frame.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.device.application().profile.outputs(self.device.image())
    }

    /// Identifiers for FIFO 0, data and remote frames.
    pub fn process_ids(&self) -> impl Iterator<Item = u16> {
        self.device.process_ids().map(CanId::get)
    }

    /// The identifiers as acceptance filters: each with a mask of the bits to compare.
    pub fn process_filters(&self) -> impl Iterator<Item = (u16, u16)> {
        self.device.process_filters().map(|(id, mask)| (id.get(), mask))
    }

    /// Identifiers for FIFO 1.
    pub fn service_ids(&self) -> impl Iterator<Item = u16> {
        self.device.service_ids().map(CanId::get)
    }
}
