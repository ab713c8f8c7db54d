//! The interface between the services and the device behind them: the inner device, or the outer device around it.

use super::basic::Basic;
use super::{Application, Job, STALE};
use crate::dictionary::{Dictionary, Entry};
use crate::lss::Configuration;
use crate::nmt::State;
use crate::sdo::Abort;
use crate::transmit::{Context, ProcessContext};
use crate::{CanId, Frame, Instant, NodeId, Transmit};

/// A device without its services. The default of every method is the behaviour of the inner device; the outer device
/// extends it.
pub trait Body: Sized {
    /// The application code of the product.
    type Application: Application;
    /// The memory of all values.
    type Image;

    /// Whether the device has PDOs.
    const HAS_PDOS: bool = false;
    /// Free places in the transmit queue that a block upload leaves: for a heartbeat and an LSS response.
    const RESERVED_ROOM: usize = 2;

    /// A device that has not started.
    fn new(dictionary: &'static Dictionary, node_id: Option<NodeId>, application: Self::Application) -> Self;

    /// The inner device.
    fn basic(&self) -> &Basic<Self::Application, [u8]>;

    /// The inner device, mutable.
    fn basic_mut(&mut self) -> &mut Basic<Self::Application, [u8]>;

    /// The values of all objects.
    fn image(&self) -> &Self::Image;

    /// Changes the NMT state.
    fn enter(&mut self, state: State) {
        let basic = self.basic_mut();
        if state == basic.state {
            return;
        }
        (basic.state, basic.services_due) = (state, STALE);
        self.entered(state);
        let basic = self.basic_mut();
        basic.application.state(state, &mut basic.image);
    }

    /// The NMT state has changed to `state`.
    fn entered(&mut self, _state: State) {}

    /// Sets objects to their values after a reset: all objects, or the communication objects only.
    fn load_values(&mut self, _everything: bool) {
        let basic = self.basic_mut();
        basic.dictionary.load_defaults(&mut basic.image);
    }

    /// Hands all protocols their parameters from the dictionary.
    fn configure(&mut self, _now: Instant) {}

    /// Takes a frame that is neither NMT nor for the services. Called in states with PDOs only.
    fn on_pdo_frame(&mut self, _frame: &Frame, _turn: &mut ProcessContext<'_, impl Transmit>) {}

    /// Sends the process data that is due.
    fn send_process(&mut self, _turn: &mut ProcessContext<'_, impl Transmit>) {
        self.basic_mut().process_due = Instant::NEVER;
    }

    /// Takes the heartbeat of another node.
    fn on_heartbeat(&mut self, _frame: &Frame, _now: Instant) {}

    /// Checks for due work other than SDO, LSS and the heartbeat of the device.
    fn poll_errors(&mut self, _turn: &mut Context<'_, impl Transmit>) {}

    /// The next deadline of `poll_errors`.
    fn errors_due(&self) -> Instant {
        Instant::NEVER
    }

    /// The value of an entry whose value is not in the image.
    fn computed(&self, _entry: &Entry) -> Result<&[u8], Abort> {
        Err(Abort::NoData)
    }

    /// Whether the rule of an entry allows a value. The inner device carries out no commands.
    fn admit(&mut self, entry: &Entry, _value: u32) -> Result<(), Abort> {
        if entry.rule().is_command() { Err(Abort::NotStored) } else { Ok(()) }
    }

    /// Applies the new value of an entry with a rule.
    fn value_written(&mut self, _entry: &Entry, _value: u32, _now: Instant) {}

    /// The job that a write to the entry by an SDO client begins, if the application wants groups stored at once. An
    /// error refuses the write before it has an effect.
    fn check_store(&self, _entry: &Entry) -> Result<Option<Job>, Abort> {
        Ok(None)
    }

    /// Begins the job of `check_store`, after the write. The response to the client waits for its end.
    fn store_at_once(&mut self, _job: Job) -> Result<(), Abort> {
        Ok(())
    }

    /// Begins to store a configuration from LSS. `false` when storing is not possible.
    fn store_configuration(&mut self, _configuration: Configuration) -> bool {
        false
    }

    /// Whether the response to the request just served has to wait. Returns `true` once.
    fn take_deferred(&mut self) -> bool {
        false
    }

    /// CAN-IDs of the heartbeats that are monitored.
    fn watched_ids(&self) -> impl Iterator<Item = CanId> {
        core::iter::empty()
    }
}
