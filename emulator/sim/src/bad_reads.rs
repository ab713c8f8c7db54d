//! Wrong reads of a flash that is too slow: below 2.7 V a read takes more wait states than a program has set that was made
//! for 3.3 V (RM0390, table 5). The core then executes code near the program counter that has a wrong bit.

use chip::random::mix;
use chip::{FLASH_BASE, Stm32f4};
use emulator::Machine;

/// The distance of a wrong bit from the program counter, in bytes.
const NEAR: u32 = 128;

/// The start of the RAM, from which the bootloader runs.
const RAM: u32 = 0x2000_0000;

/// A wrong bit at a time.
#[derive(Default)]
pub(crate) struct BadReads {
    /// The address and the right byte, while a bit is wrong.
    wrong: Option<(u32, u8)>,
    count: u64,
}

impl BadReads {
    /// Number of wrong bits so far.
    pub(crate) fn count(&self) -> u64 {
        self.count
    }

    /// Ends the wrong read, and begins another one if the flash is still too slow.
    pub(crate) fn step(&mut self, machine: &mut Machine<Stm32f4>, is_too_slow: bool) {
        self.end(machine);
        if !is_too_slow {
            return;
        }
        let noise = mix(self.count);
        let place = machine.pc().wrapping_add(noise as u32 % NEAR).wrapping_sub(NEAR / 2);
        let mut byte = [0];
        let is_code = (FLASH_BASE..RAM).contains(&place);
        if !is_code || machine.read(place, &mut byte).is_err() {
            return;
        }
        let [right] = byte;
        if machine.write(place, &[right ^ 1 << (noise >> 32 & 7)]).is_ok() {
            self.wrong = Some((place, right));
            self.count += 1;
        }
    }

    /// Ends the wrong read: the flash itself has always had the right content.
    pub(crate) fn end(&mut self, machine: &mut Machine<Stm32f4>) {
        if let Some((place, right)) = self.wrong.take() {
            // The place was written before.
            let _ = machine.write(place, &[right]);
        }
    }
}
