//! What a profile is: two halves that run in two priorities, and the two values that travel between them.
//!
//! ```text
//!             sampling, once a millisecond            protocol, whenever a frame comes
//! Inputs ──▶  Chain   ────── Snapshot ──────────────▶  Profile ──▶ image, Outputs
//!                     ◀───── Parameters ─────────────
//! ```

use canopen::ErrorClass;
use canopen::dictionary::Entry;
use canopen::nmt::State;
use canopen::sdo::{Abort, Multiplexer};

use crate::board::{Inputs, Outputs, PositionInputs, PowerOn, RETAINED_WORDS};
use crate::fault::{Fault, Flags};

/// The sampling half: from what was read in a millisecond to what the profile measures. No dictionary, no bus, no clock.
pub trait Chain {
    /// All parameters, as one consistent set.
    type Parameters;
    /// All values of one millisecond, as one consistent set.
    type Snapshot: Default;

    /// After power-on. It measures from the first parameters on.
    fn new(power_on: &PowerOn) -> Self;

    /// Takes over parameters, from the next sample on.
    fn apply(&mut self, parameters: &Self::Parameters);

    /// Processes what was read in one millisecond. The snapshot is the last one, to be replaced in its place.
    fn update(&mut self, inputs: &Inputs, snapshot: &mut Self::Snapshot);

    /// How the board has to read the position sensors.
    fn position_inputs(_parameters: &Self::Parameters) -> PositionInputs {
        PositionInputs::default()
    }

    /// Writes what is to outlive a loss of power: [`PowerOn`] has it at the next start. `false` for a profile without such
    /// values. In the place where they are needed, as this happens once a millisecond.
    fn retain(&self, _words: &mut [u32; RETAINED_WORDS]) -> bool {
        false
    }
}

/// The protocol half: what the objects of the profile mean.
pub trait Profile: Sized {
    /// The other half.
    type Chain: Chain;
    /// Where the values of its objects are in the image of a dictionary.
    type Fields: 'static;

    /// The bits of the error register (1001h) that a device of the profile has; the generic error, bit 0, is one of them.
    const REGISTER_BITS: u8 = 0xFF;

    /// The profile in a dictionary.
    fn new(fields: &'static Self::Fields) -> Self;

    /// Fills in what no table can know, after every reset: what follows from the identity and from the parameters.
    fn initialise(&mut self, _image: &mut [u8]) {}

    /// The parameters in the image. A value that no write could have put there acts as a valid one.
    fn parameters(&self, image: &[u8]) -> Parameters<Self>;

    /// Takes what was measured into the image, once a millisecond and after every reset.
    fn publish(&mut self, snapshot: &Snapshot<Self>, image: &mut [u8]);

    /// Whether it decides on writes to this object. Of the profiles in one dictionary at most one does.
    fn handles(&self, index: u16, sub: u8) -> bool;

    /// Decides on a write to an object that it handles; type and limits are checked already. It may change other values;
    /// the device stores the bytes afterwards.
    ///
    /// # Errors
    /// The reason to refuse it; nothing is stored then.
    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort>;

    /// An RPDO was received, by its number from 1: other outputs may follow.
    fn received(&mut self, _rpdo: u16, _image: &mut [u8]) {}

    /// An SDO client has written an object: other outputs may follow.
    fn written(&mut self, _entry: &Entry, _image: &mut [u8]) {}

    /// The NMT state is another one now.
    fn state(&mut self, _state: State, _image: &mut [u8]) {}

    /// A SYNC has come in the state Operational, with its counter where 1019h asks for one. What synchronous RPDOs have
    /// brought is in the image; what synchronous TPDOs carry is read from the image afterwards.
    fn synchronised(&mut self, _counter: Option<u8>, _image: &mut [u8]) {}

    /// An error of this class has happened, such as a missing heartbeat or bus-off; the NMT state then changes as 1029h
    /// says.
    fn error(&mut self, _class: ErrorClass, _image: &mut [u8]) {}

    /// Calls `each` with every fault that the profile can find, always in the same order, and whether the values show it.
    fn faults(_snapshot: &Snapshot<Self>, _each: &mut impl FnMut(&'static Fault, bool)) {}

    /// Shows which faults of the device are active, in a profile that has objects for them.
    fn show_flags(&self, _flags: Flags, _image: &mut [u8]) {}

    /// Whether a client's write to this object stores the application parameters, as 1010h:3 would.
    fn stores(&self, _index: u16, _sub: u8) -> bool {
        false
    }

    /// Whether this TPDO, by its number from 1, tells events (`canopen::Application`).
    fn sends_events(&self, _tpdo: u16) -> bool {
        false
    }

    /// This TPDO can be sent from now on: how things are is to be told.
    fn begin_events(&mut self, _tpdo: u16, _image: &mut [u8]) {}

    /// Puts the next event of this TPDO into the image; whether there was one.
    fn next_event(&mut self, _tpdo: u16, _image: &mut [u8]) -> bool {
        false
    }

    /// Whether this RPDO, a multiplexed one, takes the frames of all nodes.
    fn takes_all_nodes(&self, _rpdo: u16) -> bool {
        false
    }

    /// Whether a multiplexed PDO tells this object to all nodes.
    fn broadcasts(&self, _at: Multiplexer, _image: &[u8]) -> bool {
        true
    }

    /// What the board has to show.
    fn outputs(&self, _image: &[u8]) -> Outputs {
        Outputs::default()
    }
}

/// The parameters of a profile.
pub type Parameters<P> = <<P as Profile>::Chain as Chain>::Parameters;
/// The values that a profile measures.
pub type Snapshot<P> = <<P as Profile>::Chain as Chain>::Snapshot;
