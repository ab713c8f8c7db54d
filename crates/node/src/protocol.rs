//! The protocol half: the CANopen device and its state.

use canopen::indicators::{BusHealth, Indicators};
use canopen::lss::BitRate;
use canopen::nmt::State;
use canopen::{Action, CanId, Device, Frame, Instant, Job, NodeId, Transmit};
use profiles::board::Outputs;
use profiles::{OlderSamples, Parameters, ROOM, Snapshot};

use crate::application::NodeApplication;
use crate::faults::{Shown, present};
use crate::{Next, Setup};

/// The CANopen device of one node. The process-data task and the services task share it; each locks it for one call.
/// Every call returns the resulting actions: see [`Next`].
#[derive(Debug)]
pub struct Protocol {
    pub(crate) device: canopen::device!(NodeApplication, room: ROOM),
    /// The faults of the profile that are reported: most samples change none.
    pub(crate) shown: Shown,
    /// The job of the last `Action::Store`, until it is taken.
    pub(crate) job: Option<Job>,
    pub(crate) older_samples: OlderSamples,
}

impl Protocol {
    /// A node that has not started: it neither sends nor receives until `start`.
    #[must_use]
    pub fn new(setup: &Setup) -> Protocol {
        let dictionary = setup.personality.dictionary();
        let device =
            Device::new(dictionary, setup.node_id, NodeApplication::new(setup)).with_bit_rate(setup.bit_rate);
        Protocol { device, shown: Shown::default(), job: None, older_samples: OlderSamples::NONE }
    }

    /// Initialises the values that the pending reset covers, then boots up. To be called once the bus is ready, and
    /// again for `Action::ResetCommunication`.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let next = self.device.start(now, out);
        // The error register is not known before the start.
        self.device.show(|application, image| application.show_flags(image));
        self.note(next)
    }

    /// Keeps the job for `take_job`, and takes note of new parameters.
    #[inline(never)]
    pub(crate) fn note(&mut self, next: Next) -> Next {
        if next.parameters {
            self.older_samples = OlderSamples::BEGIN;
        }
        if let Some(Action::Store(job)) = next.action {
            self.job = Some(job);
        }
        next
    }

    /// Reports the bit rate at which the bus runs: process data take three quarters of it at most.
    pub fn set_bus_bit_rate(&mut self, bit_rate: BitRate) {
        self.device.set_bus_bit_rate(bit_rate);
    }

    /// Takes a detected bit rate as the configured one, for a node without a stored rate: LSS and a new personality store
    /// it with the other values of the device record.
    pub fn adopt_bit_rate(&mut self, bit_rate: BitRate) {
        self.device.set_bit_rate(bit_rate);
        self.device.application_mut().configured.set_bit_rate(bit_rate);
    }

    /// The node-ID in use; `None` while the node waits for LSS to assign one.
    #[must_use]
    pub fn node_id(&self) -> Option<NodeId> {
        self.device.node_id()
    }

    /// The NMT state.
    #[must_use]
    pub fn state(&self) -> State {
        self.device.state()
    }

    /// The states of the indicators RUN and ERROR.
    #[must_use]
    pub fn indicators(&self, bus: BusHealth) -> Indicators {
        self.device.indicators(bus)
    }

    /// Whether the node works: it has sent its boot-up message, and values were measured.
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

    /// A frame of FIFO 1: any other frame.
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) -> Next {
        self.note_master(frame);
        let next = self.device.on_service_frame(frame, now, out);
        self.note(next)
    }

    /// The snapshot of the last millisecond, for [`publish`](Protocol::publish): the measurement writes its values
    /// here, or they are copied once.
    pub fn snapshot_mut(&mut self) -> &mut Snapshot {
        &mut self.device.application_mut().snapshot
    }

    /// Copies the values of the last millisecond into the dictionary, and sends the PDOs that their change triggers and
    /// the process data that is due. Without a snapshot only due process data is sent. When a job of `take_job` no longer
    /// waits for samples, the services are due at once.
    pub fn publish(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        self.preset_by_input();
        let snapshot = &self.device.application().snapshot;
        if matches!(snapshot, Snapshot::Nothing) {
            return self.device.poll_process(now, out);
        }
        let is_last = self.older_samples.take();
        let changed = self.shown.update(present(snapshot));
        if changed != 0 {
            self.follow_faults(changed, now);
        }
        let next = self.device.publish(now, out, NodeApplication::show_values);
        let can_store = is_last && self.job.is_some();
        if can_store { Next { services: now, ..next } } else { next }
    }

    /// Carries out a preset by a digital input: the preset of the object is written again.
    fn preset_by_input(&mut self) {
        let mut preset = None;
        self.device.show(|application, image| {
            preset = application.profile.take_preset(image).map(|at| (at, application.value_at(at, image)));
        });
        if let Some((at, value)) = preset {
            self.device.write_value(at, &value);
        }
    }

    /// Handles expired PDO and SYNC timers.
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        self.device.poll_process(now, out)
    }

    /// Handles expired heartbeat, SDO and EMCY timers.
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Next {
        let next = self.device.poll_services(now, out);
        self.note(next)
    }

    /// The parameters for `Measurement::apply`; [`Next::parameters`] tells when they have changed.
    #[must_use]
    pub fn parameters(&self) -> Parameters {
        self.device.application().profile.parameters(self.device.image())
    }

    /// The outputs of the board. To be called after each frame.
    #[must_use]
    pub fn outputs(&self) -> Outputs {
        self.device.application().profile.outputs(self.device.image())
    }

    /// Identifiers for FIFO 0, data and remote frames.
    pub fn process_ids(&self) -> impl Iterator<Item = u16> {
        self.device.process_ids().map(CanId::get)
    }

    /// The identifiers for FIFO 0 as acceptance filters: each with a mask of the bits to compare.
    pub fn process_filters(&self) -> impl Iterator<Item = (u16, u16)> {
        self.device.process_filters().map(|(id, mask)| (id.get(), mask))
    }

    /// Identifiers for FIFO 1.
    pub fn service_ids(&self) -> impl Iterator<Item = u16> {
        self.device.service_ids().map(CanId::get)
    }
}
