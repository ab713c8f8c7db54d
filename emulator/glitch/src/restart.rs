//! What the bootloader decides by after a reset. Most faults end in a reset, and most of these resets leave the same: so the decision
//! after such a reset is run once.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::ops::Range;

use bsp::crash_record::{Crash, Sealed, WORDS};
use chip::{Peripherals, Stm32f4};
use emulator::Machine;

/// The region RETAINED (memory.x): of RAM the bootloader reads nothing else before it has written it.
const RETAINED: Range<u32> = 0x2001_FF00..0x2002_0000;
/// Where the crash record is in RETAINED, after the handover and the count of crashes (bsp, `retained`).
const CRASH: Range<usize> = 12..12 + 4 * WORDS;
/// RCC_CSR: why the chip was reset.
const CAUSE: u32 = 0x4002_3874;

/// All that is left after a reset and can change what the bootloader decides.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Restart {
    /// A hash of the flash.
    flash: u64,
    /// RETAINED with an empty crash record.
    retained: Vec<u8>,
    /// There is a crash record: the bootloader looks for nothing else in the record.
    is_crash: bool,
    cause: Option<u32>,
}

impl Restart {
    /// Of a machine that was just reset.
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

/// What a reset leaves alone of RAM.
pub(crate) fn retained(machine: &Machine<Stm32f4>) -> Vec<u8> {
    let mut bytes = vec![0; RETAINED.len()];
    let _ = machine.read(RETAINED.start, &mut bytes);
    bytes
}
