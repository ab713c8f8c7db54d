//! The protocol half: the CANopen device with everything it owns.

use crate::faults::Conditions;
use crate::profile::{IMAGE_SIZE, Profile};
use crate::{Parameters, Request, Setup, Snapshot};
use canopen::nmt::State;
use canopen::{Action, CanId, Device, Frame, Instant, Job, NodeId, Transmit};
use profiles::lift::panel::LAMPS;

/// The CANopen device of one node. The process-data task and the services task share it; each locks it for one call.
///
/// A call that takes a frame, a snapshot or an event may move the next deadline: ask `poll_process` and
/// `poll_services` afterwards. Where nothing is due, a poll is a comparison.
#[derive(Debug)]
pub struct Protocol {
    pub(crate) device: Device<Profile, IMAGE_SIZE>,
    /// As last published: most samples change nothing.
    pub(crate) conditions: Conditions,
    pub(crate) is_bus_off: bool,
    /// What `Request::Store` is about.
    pub(crate) job: Option<Job>,
}

impl Protocol {
    /// A node that has not started: it is silent and hears nothing until `start`.
    #[must_use]
    pub fn new(setup: &Setup) -> Protocol {
        let dictionary = setup.personality.definition().dictionary;
        let device =
            Device::new(dictionary, setup.node_id, Profile::new(setup)).with_bit_rate(setup.bit_rate);
        Protocol { device, conditions: Conditions::default(), is_bus_off: false, job: None }
    }

    /// Initialises what the pending reset covers, then boots up. To be called once the bus is ready,
    /// and again for `Request::ResetCommunication`.
    pub fn start(&mut self, now: Instant, out: &mut impl Transmit) {
        self.device.start(now, out);
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

    /// A frame of FIFO 0: NMT, SYNC, RPDO, or a remote request for a TPDO.
    pub fn on_process_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.device.on_process_frame(frame, now, out);
        self.device.update(Profile::follow_output);
    }

    /// A frame of FIFO 1: everything else.
    pub fn on_service_frame(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.device.on_service_frame(frame, now, out);
        self.device.update(Profile::follow_output);
    }

    /// Takes the values of the last millisecond into the dictionary and sends what their change triggers. Before the
    /// measurement has parameters there are none.
    pub fn publish(&mut self, snapshot: &Snapshot, now: Instant, out: &mut impl Transmit) {
        if snapshot.is_empty() {
            return;
        }
        self.device.application_mut().snapshot = *snapshot;
        self.device.show(Profile::show_values);
        let conditions = Conditions::of(snapshot);
        if self.conditions != conditions {
            self.take_conditions(conditions, now, out);
        }
        self.device.changed(now, out);
    }

    /// Does what is due of PDO and SYNC timers. Returns the instant at which it wants to be called again.
    pub fn poll_process(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.device.poll_process(now, out)
    }

    /// Does what is due of heartbeat, SDO and EMCY. Returns the instant at which it wants to be called again.
    pub fn poll_services(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        self.device.poll_services(now, out)
    }

    /// The next thing that the firmware must do. To be asked after every call above until it is `None`.
    pub fn take_request(&mut self) -> Option<Request> {
        Some(match self.device.take_action()? {
            Action::ResetNode => Request::ResetNode,
            Action::ResetCommunication => Request::ResetCommunication,
            Action::Identifiers => Request::Filters,
            Action::Bootloader => Request::Bootloader,
            Action::BitRate(bit_rate) => Request::BitRate(bit_rate),
            Action::Store(job) => {
                self.job = Some(job);
                Request::Store
            }
        })
    }

    /// The parameters for `Measurement::apply`, when they have changed since the last call (and after `start`).
    pub fn take_parameters(&mut self) -> Option<Parameters> {
        self.device.take_parameters_changed().then(|| self.parameters())
    }

    /// The parameters with which `start` will begin: a measurement that has them before has a sample for the first PDO.
    pub fn prepare(&mut self) -> Parameters {
        self.device.prepare();
        self.parameters()
    }

    fn parameters(&self) -> Parameters {
        let image = self.device.image();
        let definition = self.device.application().definition();
        Parameters {
            pressure: definition.pressure.map(|fields| fields.parameters(image)),
            encoder: definition.encoder.map(|fields| fields.parameters(image)),
            lift: definition.lift.map(|fields| fields.parameters(image)),
        }
    }

    /// Which lamps of the panel are lit. To be asked after each frame.
    #[must_use]
    pub fn lamps(&self) -> [bool; LAMPS] {
        self.device.application().lit(self.device.image())
    }

    /// Identifiers for FIFO 0, data and remote frames.
    pub fn process_ids(&self) -> impl Iterator<Item = u16> {
        self.device.process_ids().map(CanId::get)
    }

    /// Identifiers for FIFO 1.
    pub fn service_ids(&self) -> impl Iterator<Item = u16> {
        self.device.service_ids().map(CanId::get)
    }
}
