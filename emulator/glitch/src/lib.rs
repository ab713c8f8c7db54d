//! Fault injection: what one skipped instruction, or one flipped bit of one register, does to the decision of the bootloader.
//!
//! A supply that dips or a clock that stumbles for some nanoseconds makes a processor leave out an instruction or take a wrong value.
//! Here the emulated board does that, at each point of the decision in turn, and then goes on without further faults. Nothing that
//! is unsigned, and nothing older than what was there, may start.
//!
//! | module | |
//! |---|---|
//! | `program` | small applications that say that they run |
//! | `scene` | what lies in the flash, and what must not run |
//! | `rig` | a board that is switched on, stopped at points, disturbed and watched |
//! | `campaign` | all points of a scene |
//! | `places` | where a point is in the source |
#![forbid(unsafe_code)]

mod campaign;
mod places;
mod program;
mod rig;
mod scene;

pub use campaign::{Campaign, Extent, OFTEN, Violation, Watcher};
pub use places::Places;
pub use rig::{Fault, Outcome};
pub use scene::Scene;
