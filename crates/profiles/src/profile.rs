//! The interface of a profile: two halves that run in two priorities, and the two values that they exchange.
//!
//! ```text
//!             sampling, once a millisecond            protocol, whenever a frame comes
//! Inputs ──▶  Chain   ────── Snapshot ──────────────▶  Profile ──▶ image, Outputs
//!                     ◀───── Parameters ─────────────
//! ```

use canopen::ErrorClass;
use canopen::dictionary::{Entry, Groups};
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};

use crate::board::{Inputs, Outputs, PositionInputs, PowerOn, RETAINED_WORDS};
use crate::fault::{Fault, Flags};

/// The sampling half: from the readings of a millisecond to the measured values. No dictionary, no bus, no clock.
pub trait Chain {
    /// All parameters, as one consistent set.
    type Parameters;
    /// All values of one millisecond, as one consistent set.
    type Snapshot: Default;

    /// The chain after power-on. Measuring begins with the first parameters.
    fn new(power_on: &PowerOn) -> Self;

    /// Takes over parameters; they act from the next sample on.
    fn apply(&mut self, parameters: &Self::Parameters);

    /// Processes the readings of one millisecond. `snapshot` is the last one, to be replaced in its place.
    fn update(&mut self, inputs: &Inputs, snapshot: &mut Self::Snapshot);

    /// Settings of the board's position inputs.
    fn position_inputs(_parameters: &Self::Parameters) -> PositionInputs {
        PositionInputs::default()
    }

    /// Writes the state to be retained through a loss of power; the next start gets it in [`PowerOn`]. `false` for a
    /// profile without such state. Writes directly to the destination, because this happens once a millisecond.
    fn retain(&self, _words: &mut [u32; RETAINED_WORDS]) -> bool {
        false
    }
}

/// The protocol half: the behaviour of the profile's objects.
pub trait Profile: Sized {
    /// The sampling half.
    type Chain: Chain;
    /// The places of the profile's values in the image of a dictionary.
    type Fields: 'static;

    /// The bits of the error register (1001h) that a device of the profile uses, including bit 0, generic error.
    const REGISTER_BITS: u8 = 0xFF;

    /// The profile in a dictionary.
    fn new(fields: &'static Self::Fields) -> Self;

    /// Fills in the values that the table cannot have, after every reset: those that depend on the identity and on the
    /// parameters. `defaults`: the groups that the reset has given their defaults, not stored values.
    fn initialise(&mut self, _image: &mut [u8], _defaults: Groups) {}

    /// The parameters in the image. An impossible value acts as a valid one.
    fn parameters(&self, image: &[u8]) -> Parameters<Self>;

    /// Copies measured values into the image, once a millisecond and after every reset.
    fn publish(&mut self, snapshot: &Snapshot<Self>, image: &mut [u8]);

    /// Whether the profile decides on writes to this object. At most one of the profiles in a dictionary may do so.
    fn handles(&self, index: u16, sub: u8) -> bool;

    /// Checks a write to an object that the profile handles; type and limits are checked already. The profile may
    /// change other values; the device stores the bytes afterwards.
    ///
    /// # Errors
    /// The reason for the refusal; nothing is stored in that case.
    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort>;

    /// An RPDO was received (numbered from 1), so outputs may change.
    fn received(&mut self, _rpdo: u16, _image: &mut [u8]) {}

    /// An SDO client has written an object, so outputs may change.
    fn written(&mut self, _entry: &Entry, _image: &mut [u8]) {}

    /// The NMT state has changed.
    fn state(&mut self, _state: State, _image: &mut [u8]) {}

    /// A SYNC has come in the state Operational, with its counter where 1019h asks for one. What synchronous RPDOs have
    /// brought is in the image; what synchronous TPDOs carry is read from the image afterwards.
    fn synchronised(&mut self, _counter: Option<u8>, _image: &mut [u8]) {}

    /// An error of this class has happened, such as a missing heartbeat or bus-off; the NMT state then changes as 1029h
    /// says.
    fn error(&mut self, _class: ErrorClass, _image: &mut [u8]) {}

    /// Calls `each` with every fault that the profile detects, always in the same order, and whether the values show
    /// the fault.
    fn faults(_snapshot: &Snapshot<Self>, _each: &mut impl FnMut(&'static Fault, bool)) {}

    /// Shows the active faults of the device, in a profile that has objects for them.
    fn show_flags(&self, _flags: Flags, _image: &mut [u8]) {}

    /// Whether a client's write to this object stores the application parameters, as 1010h:3 would.
    fn stores(&self, _index: u16, _sub: u8) -> bool {
        false
    }

    /// Whether a write to this object can switch PDOs on or off, or change the result of [`broadcasts`](Profile::broadcasts).
    fn switches_pdos(&self, _index: u16) -> bool {
        false
    }

    /// Whether this TPDO (numbered from 1) sends events (`canopen::Application`).
    fn sends_events(&self, _tpdo: u16) -> bool {
        false
    }

    /// This TPDO can be sent from now on, so the present state must be sent.
    fn begin_events(&mut self, _tpdo: u16, _image: &mut [u8]) {}

    /// Puts the next event of this TPDO into the image; returns whether there was one.
    fn next_event(&mut self, _tpdo: u16, _image: &mut [u8]) -> bool {
        false
    }

    /// Whether the change of the value at this place of the image, since the TPDO was sent, is below its threshold
    /// (`canopen::Application::is_quiet`).
    fn is_quiet(&self, _tpdo: usize, _place: usize, _image: &[u8]) -> bool {
        false
    }

    /// A TPDO has been sent (`canopen::Application::sent`).
    fn sent(&mut self, _tpdo: usize, _image: &[u8]) {}

    /// A preset by a digital input: the object to be written with its own value, as by a PDO.
    fn take_preset(&mut self, _image: &[u8]) -> Option<Multiplexer> {
        None
    }

    /// Whether this multiplexed RPDO receives the frames of all nodes.
    fn takes_all_nodes(&self, _rpdo: u16) -> bool {
        false
    }

    /// Whether a multiplexed PDO sends this object to all nodes.
    fn broadcasts(&self, _at: Multiplexer, _image: &[u8]) -> bool {
        true
    }

    /// Outputs of the profile to the board.
    fn outputs(&self, _image: &[u8]) -> Outputs {
        Outputs::default()
    }
}

/// The parameters of a profile.
pub type Parameters<P> = <<P as Profile>::Chain as Chain>::Parameters;
/// The values that a profile measures.
pub type Snapshot<P> = <<P as Profile>::Chain as Chain>::Snapshot;
