//! The protections of the chip that the project leaves off by default: the bootloader's sectors against erasing and
//! programming, and the whole flash against reading (docs/update.md, Protection).
//!
//! A debug probe sets the protections, not the bootloader at its first start. Code that can write option bytes can go
//! wrong in the field, where they cannot be corrected, and an attacker can use such code. A probe is needed anyway when
//! a board gets its bootloader, and its user sees at once whether the setting has worked.

mod option_bytes;
pub mod probe;
mod sequence;

pub use option_bytes::{OptionBytes, ReadOut};
pub use sequence::{Error, Registers, current, program};
