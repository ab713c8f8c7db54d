//! The protections of the chip that the project leaves off: the sectors of the bootloader against erasing and programming,
//! and the whole flash against reading (docs/update.md, Protection).
//!
//! They are set from outside, with a debug probe, and not by the bootloader at its first start: code that can write option
//! bytes is code that can go wrong in the field, where nobody can put them right, and that an attacker can use; a probe is
//! there anyway when a board gets its bootloader, and whoever holds it sees at once whether it has worked.
#![forbid(unsafe_code)]

mod option_bytes;
pub mod probe;
mod sequence;

pub use option_bytes::{OptionBytes, ReadOut};
pub use sequence::{Error, Registers, current, program};
