//! Fault injection: what one skipped instruction, one flipped condition flag, or one flipped bit of one register does to the decision of the bootloader.
//!
//! A supply dip or a clock glitch of some nanoseconds makes a processor skip an instruction or read a wrong value. The emulated
//! board injects one such fault at each point of the decision in turn, and continues without further faults. The bootloader must
//! start no unsigned image and no image older than the previous one.
//!
//! | module | |
//! |---|---|
//! | `program` | small applications that mark RAM when they run |
//! | `scene` | contents of the flash with a program that must not run |
//! | `fault` | faults of the core |
//! | `reads` | the registers and flags that an instruction reads |
//! | `choice` | selection of the faults at a point |
//! | `rig` | the board: power-on, stops at points, injection, outcome |
//! | `restart` | state that survives a reset and enters the decision |
//! | `campaign` | injection at the points of a scene |
//! | `places` | functions of the image by address |

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
