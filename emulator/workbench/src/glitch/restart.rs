//! State that survives a reset and enters the decision of the bootloader. Most faults end in a reset, and most of these resets leave
//! the same state, so the decision after each state is run once.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use bsp::chip::crash_record::{Crash, Sealed, WORDS};
use chip::{Peripherals, Stm32f4};
use emulator::Machine;

/// The region RETAINED (memory.x): the bootloader reads no other RAM before it has written it.
const RETAINED: Range<u32> = 0x2001_FF00..0x2002_0000;
/// Place of the crash record in RETAINED, after the handover and the count of crashes (bsp, `retained`).
const CRASH: Range<usize> = 12..12 + 4 * WORDS;
/// RCC_CSR: the cause of the reset.
const CAUSE: u32 = 0x4002_3874;

/// State after a reset that can change the decision of the bootloader.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Restart {
    /// A hash of the flash.
    flash: u64,
    /// RETAINED with an empty crash record.
    retained: Vec<u8>,
    /// Whether a crash record exists: the bootloader reads nothing else from it.
    is_crash: bool,
    cause: Option<u32>,
}

impl Restart {
    /// State of a machine that was just reset.
    pub(crate) fn of(machine: &mut Machine<Stm32f4>) -> Restart {
        let mut hasher = DefaultHasher::new();
        machine.flash().hash(&mut hasher);
        let now = machine.now();
        let cause = machine.peripherals_mut().read(CAUSE, 4, now).ok();
        let mut retained = retained(machine);
        let is_crash = Crash::open(&record(&retained)).is_some();
        retained[CRASH].fill(0);
        Restart { flash: hasher.finish(), retained, is_crash, cause }
    }
}

/// The crash record.
fn record(retained: &[u8]) -> Sealed {
    let (words, _) = retained[CRASH].as_chunks();
    std::array::from_fn(|at| u32::from_le_bytes(words[at]))
}

/// RAM that a reset does not change.
pub(crate) fn retained(machine: &Machine<Stm32f4>) -> Vec<u8> {
    let mut bytes = vec![0; RETAINED.len()];
    let _ = machine.read(RETAINED.start, &mut bytes);
    bytes
}
