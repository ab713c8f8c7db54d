//! Small applications that write a word to RAM from any entry point, and wait for the watchdog.

use bsp::flash::sectors::FLASH;
use bsp::flash::update_layout::LAYOUT;
use update::HEADER_LEN;

/// Address of the word: the far end of the stack, which the bootloader does not reach.
pub(crate) const PLACE: u32 = 0x2000_0000;
/// Word of the permitted application.
pub(crate) const GOOD: u32 = 0x600D_600D;
/// Word of the forbidden application.
pub(crate) const BAD: u32 = 0x0BAD_0BAD;

const STACK: u32 = 0x2002_0000;
/// Number of vectors, all of which lead to the entry: a fault before the application also starts it.
const VECTORS: u32 = 15;
const NOP: u16 = 0xBF00;
/// Number of NOPs before the code, so that a jump to a wrong address also runs it.
const SLED: usize = 56;

/// Code of an application that writes this word, with its vector table.
pub(crate) fn code(word: u32) -> Vec<u8> {
    let entry = FLASH + LAYOUT.application().start() + HEADER_LEN as u32 + 4 * (1 + VECTORS);
    // ldr r0, =PLACE; ldr r1, =word; str r1, [r0]; b .
    let says = [0x4801, 0x4902, 0x6001, 0xE7FE];
    let instructions = [NOP; SLED].into_iter().chain(says);
    let vectors = std::iter::once(STACK).chain((0..VECTORS).map(|_| entry | 1));
    let mut code: Vec<u8> = vectors.flat_map(u32::to_le_bytes).collect();
    code.extend(instructions.flat_map(u16::to_le_bytes));
    code.extend([PLACE, word].map(u32::to_le_bytes).concat());
    code
}
