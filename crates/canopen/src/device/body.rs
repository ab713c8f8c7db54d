//! The interface between the services and the device that they serve: the inner device, or the outer one around it.

use super::basic::Basic;
use super::{Application, STALE};
use crate::dictionary::{Dictionary, Entry};
use crate::lss::Configuration;
use crate::nmt::State;
use crate::sdo::Abort;
use crate::transmit::Turn;
use crate::{CanId, Frame, Instant, NodeId, Transmit};

/// A device without its services. Every method has the default of the inner device; the outer one adds what it has
/// around the inner one.
pub trait Body: Sized {
    /// The product's own code.
    type Application: Application;
    /// The memory of all values.
    type Image;

    /// Frames for which a block upload leaves room in the queue: a heartbeat and an answer of LSS.
    const RESERVED_ROOM: usize = 2;

    /// A device that has not started.
    fn new(dictionary: &'static Dictionary, node_id: Option<NodeId>, application: Self::Application) -> Self;

    /// The inner device.
    fn basic(&self) -> &Basic<Self::Application, [u8]>;

    /// The inner device, to change it.
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

    /// Follows a change of the NMT state.
    fn entered(&mut self, _state: State) {}

    /// Gives the objects their values of after a reset: all of them, or those of communication.
    fn load_values(&mut self, _everything: bool) {
        let basic = self.basic_mut();
        basic.dictionary.load_defaults(&mut basic.image);
    }

    /// Gives every protocol its parameters.
    fn configure(&mut self, _now: Instant) {}

    /// Takes a frame that is neither NMT nor for the services, in a state that has PDOs.
    fn on_pdo_frame(&mut self, _frame: &Frame, _turn: &mut Turn<'_, impl Transmit>) {}

    /// Sends what is due of process data.
    fn send_process(&mut self, _turn: &mut Turn<'_, impl Transmit>) {
        self.basic_mut().process_due = Instant::NEVER;
    }

    /// Takes the heartbeat of another node.
    fn on_heartbeat(&mut self, _frame: &Frame, _now: Instant) {}

    /// Looks for what is due besides SDO, LSS and the own heartbeat.
    fn poll_errors(&mut self, _turn: &mut Turn<'_, impl Transmit>) {}

    /// When `poll_errors` has something to do.
    fn errors_due(&self) -> Instant {
        Instant::NEVER
    }

    /// The value of an entry whose value is not in the image.
    fn computed(&self, _entry: &Entry) -> Result<&[u8], Abort> {
        Err(Abort::NoData)
    }

    /// Whether the rule of an entry allows a value. The inner device carries out no command.
    fn admit(&mut self, entry: &Entry, _value: u32) -> Result<(), Abort> {
        if entry.rule().is_command() { Err(Abort::NotStored) } else { Ok(()) }
    }

    /// Takes note of the new value of an entry with a rule.
    fn follow(&mut self, _entry: &Entry, _value: u32, _now: Instant) {}

    /// An SDO client has written the entry: stores what the application says is stored at once.
    fn store_at_once(&mut self, _entry: &Entry) -> Result<(), Abort> {
        Ok(())
    }

    /// Begins to store what LSS has configured; whether that is possible.
    fn store_configuration(&mut self, _configuration: Configuration) -> bool {
        false
    }

    /// Whether the response to the request just served has to wait; once.
    fn take_deferred(&mut self) -> bool {
        false
    }

    /// Identifiers of the heartbeats that are watched.
    fn watched_ids(&self) -> impl Iterator<Item = CanId> {
        core::iter::empty()
    }
}
