//! Fault injection: what one skipped instruction, one flipped condition flag, or one flipped bit of one register does to the decision of the bootloader.
//!
//! A supply that dips or a clock that stumbles for some nanoseconds makes a processor leave out an instruction or take a wrong value.
//! Here the emulated board does that, at each point of the decision in turn, and then goes on without further faults. Nothing that
//! is unsigned, and nothing older than what was there, may start.
//!
//! | module | |
//! |---|---|
//! | `program` | small applications that say that they run |
//! | `scene` | what lies in the flash, and what must not run |
//! | `fault` | what goes wrong |
//! | `reads` | the registers and flags that an instruction reads |
//! | `choice` | the faults of a point |
//! | `rig` | a board that is switched on, stopped at points, disturbed and watched |
//! | `restart` | what the bootloader decides by after a reset |
//! | `campaign` | all points of a scene |
//! | `places` | where a point is in the source |
#![forbid(unsafe_code)]

mod campaign;
mod choice;
mod fault;
mod places;
mod program;
mod reads;
mod restart;
mod rig;
mod scene;

pub use campaign::{Campaign, Extent, OFTEN, Violation, Watcher};
pub use fault::Fault;
pub use places::Places;
pub use rig::Outcome;
pub use scene::Scene;
