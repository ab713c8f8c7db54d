//! The position through a loss of power: from the measurement to the memory that a battery keeps, and back at the start.

use bsp::BackupMemory;
use bsp::kept::{CAPACITY, Found};
use node::{Kept, Start};

const _: () = assert!(Kept::SIZE <= CAPACITY);

/// What the encoder goes on from.
///
/// Memory without a trace of a copy is that of a new board, and after a loss of power that of one without a battery, or with
/// an empty one: the two cannot be told apart, and the encoder begins anew.
pub(crate) fn start(found: &Found) -> Start {
    match found {
        Found::Nothing => Start::First,
        Found::Kept(bytes) => {
            bytes.first_chunk().map_or(Start::Damaged, |kept| Start::Kept(Kept::from_bytes(kept)))
        }
        Found::Damaged => {
            defmt::error!("what was kept of the encoder is damaged");
            Start::Damaged
        }
    }
}

/// Keeps the latest.
pub(crate) fn keep(memory: &mut BackupMemory, kept: &Kept) {
    memory.write(&kept.to_bytes());
}
