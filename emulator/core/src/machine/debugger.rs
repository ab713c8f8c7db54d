//! The machine at a debug probe: programs, memory and registers.

use chip::{BusFault, Peripherals};
use unicorn_engine::RegisterARM;

use super::Machine;
use crate::engine;
use crate::loader::{self, Image};
use crate::model::Error;

/// The begin of the core's system space (ARMv7-M, B3.1).
const PRIVATE: u32 = 0xE000_0000;

impl<P: Peripherals + 'static> Machine<P> {
    /// Writes the segments of an ELF file into flash, as a debug probe does.
    ///
    /// # Errors
    /// [`Error::Elf`] for any file but a program for this chip; nothing is written then.
    pub fn load_elf(&mut self, file: &[u8]) -> Result<Image, Error> {
        let image = loader::parse(file, &self.model)?;
        for segment in &image.segments {
            engine::store(&mut self.cpu, segment.address, &segment.bytes)?;
        }
        Ok(image)
    }

    /// Reads an ELF file for this chip without writing it to flash, unlike [`Machine::load_elf`].
    ///
    /// # Errors
    /// [`Error::Elf`] for any file but a program for this chip.
    pub fn parse_elf(&self, file: &[u8]) -> Result<Image, Error> {
        loader::parse(file, &self.model)
    }

    /// Number of changes of the flash array: by stores and erases of the program, and by loading.
    pub fn flash_changes(&self) -> u64 {
        self.cpu.get_data().flash_changes
    }

    /// The flash array.
    pub fn flash(&self) -> Vec<u8> {
        let mut bytes = vec![0; self.model.flash.len()];
        let _ = self.read(self.model.flash.start, &mut bytes);
        bytes
    }

    /// Writes `contents` to the start of the flash array.
    ///
    /// # Errors
    /// When `contents` is longer than the array.
    pub fn set_flash(&mut self, contents: &[u8]) -> Result<(), Error> {
        engine::store(&mut self.cpu, self.model.flash.start, contents)
    }

    /// Reads memory; registers of the chip are not accessible.
    ///
    /// # Errors
    /// [`BusFault`] where there is no memory.
    pub fn read(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        self.cpu.get_data().memory.read(address, bytes).ok_or(BusFault)
    }

    /// Writes memory; registers of the chip are not accessible.
    ///
    /// # Errors
    /// [`BusFault`] where there is no memory.
    pub fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), BusFault> {
        engine::store(&mut self.cpu, address, bytes).map_err(|_| BusFault)
    }

    /// Reads a word as a debug probe does, while the program runs: memory, the core's registers in the system space, or a
    /// peripheral. `None` where nothing answers.
    pub fn debug_read(&mut self, address: u32) -> Option<u32> {
        let mut bytes = [0; 4];
        if Machine::read(self, address, &mut bytes).is_ok() {
            return Some(u32::from_le_bytes(bytes));
        }
        let core = self.cpu.get_data_mut();
        if (PRIVATE..).contains(&address) {
            return core.ppb_read(address, 0);
        }
        core.chip.read(address, 4, core.now).ok()
    }

    /// Writes a word of the system space or of a peripheral, as a debug probe does. `None` where nothing answers.
    pub fn debug_write(&mut self, address: u32, value: u32) -> Option<()> {
        let core = self.cpu.get_data_mut();
        if (PRIVATE..).contains(&address) {
            return core.ppb_write(address, value);
        }
        core.chip.write(address, 4, value, core.now).ok()
    }

    /// Sets a core register, as a debugger does: 0 to 12, 13 the stack pointer, 14 the link register, 15 the program
    /// counter. Other numbers are ignored.
    pub fn set_register(&mut self, number: u8, value: u32) {
        let special = [RegisterARM::SP, RegisterARM::LR, RegisterARM::PC];
        match number {
            0..=12 => drop(self.cpu.reg_write(RegisterARM::R0 as i32 + i32::from(number), value.into())),
            13..=15 => self.set(special[usize::from(number - 13)], value),
            _ => {}
        }
    }
}
