//! The application slot from the bootloader's side.
#![expect(unsafe_code, reason = "memory by its address, and the jump to the application")]

use crate::chip::vectors::Vectors;
use crate::chip::{confinement, memory, retained};

/// The vectors of the application; `None` if the slot has nothing that could be started.
pub fn vectors() -> Option<Vectors> {
    let image = memory::application();
    // SAFETY: the first two words of the slot are flash, which is readable whatever its content.
    let words = unsafe { (image.start as *const [u32; 2]).read_volatile() };
    Vectors::check(words, &memory::ram(), &image)
}

/// Number of NVIC words in the chip: up to 97 interrupts (RM0390, table 38).
const INTERRUPT_WORDS: usize = 4;

/// Whether the place of the header is erased, as after programming with a debugger.
pub fn has_no_header() -> bool {
    let bytes = memory::header();
    bytes.iter().all(|byte| *byte == 0xFF)
}

/// The seal of an application without a header: erased flash has this word where a header has its CRC.
pub const SEAL_OF_NO_HEADER: u32 = u32::MAX;

/// Starts the application as a reset would. Nothing of the caller continues: interrupts are off until the application
/// has its own vector table, and its stack replaces the caller's.
///
/// The caller must not have started a peripheral that writes to memory on its own; the bootloader starts none.
///
/// The application starts only with its own seal (see [`update::boot_sealed`]): with any other word in RAM this
/// function uses wrong addresses for the vectors and the entry, and the watchdog resets the chip.
pub fn start(core: &cortex_m::Peripherals, vectors: Vectors) -> ! {
    let wrong = retained::seal() ^ memory::header_crc();
    let table = memory::application().start ^ wrong;
    cortex_m::interrupt::disable();
    // SAFETY: the slot is aligned as VTOR needs it (memory.x), `vectors` is checked, and this function does not return,
    // so the stack is not needed. Interrupts are enabled again, as after a reset; none is enabled in the NVIC.
    unsafe {
        for (enabled, pending) in core.NVIC.icer.iter().zip(&core.NVIC.icpr).take(INTERRUPT_WORDS) {
            enabled.write(u32::MAX);
            pending.write(u32::MAX);
        }
        core.SCB.vtor.write(table);
        confinement::end();
        cortex_m::interrupt::enable();
        cortex_m::asm::bootstrap(vectors.stack() as *const u32, (vectors.reset() ^ wrong) as *const u32)
    }
}
