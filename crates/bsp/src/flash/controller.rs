//! The flash controller: words of 32 bits, sectors (RM0390, 3).
//!
//! The driver of stm32f4xx-hal is not used, because it programs byte by byte, erases several sectors instead of one,
//! and leaves error flags behind.
#![expect(unsafe_code, reason = "registers, and flash by its address")]

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};
use stm32f4xx_hal::pac::FLASH;

use crate::flash::flash_area::FlashArea;

/// Key sequence that unlocks the control register (RM0390, 3.5.1).
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// The error flags of SR; writing 1 clears one.
const ERRORS: u32 = 0b1_1111_0010;
/// Number of reads of BSY before an operation is given up: about 10 ms for programming a word (the data sheet allows
/// 100 us), about 2.5 s for an erase (the data sheet allows 2 s). Reads are counted because the time base is not always
/// running when the bootloader programs.
const PROGRAM_POLLS: u32 = 1 << 17;
const ERASE_POLLS: u32 = 1 << 25;

/// The flash controller.
pub struct Flash(FLASH);

/// Why an operation failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// The place is outside of the area or not aligned.
    Place(NorFlashErrorKind),
    /// The error flags of the controller (RM0390, 3.8.4).
    Flags(u32),
    /// The controller is busy for longer than any operation takes.
    Busy,
    /// The supply is too low to change the flash.
    Supply,
}

impl From<NorFlashErrorKind> for Error {
    fn from(kind: NorFlashErrorKind) -> Error {
        Error::Place(kind)
    }
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Error::Place(kind) => *kind,
            Error::Flags(_) | Error::Busy | Error::Supply => NorFlashErrorKind::Other,
        }
    }
}

impl Flash {
    /// Takes the controller.
    #[must_use]
    pub(crate) fn new(flash: FLASH) -> Flash {
        Flash(flash)
    }

    /// Copies bytes from flash, fast for a few bytes such as a word.
    pub(crate) fn read(&self, area: &FlashArea, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let address = area.address(offset, bytes.len(), 1)?;
        // SAFETY: all bytes lie in flash, which is always readable, and it is not programmed during the call, because
        // programming needs this value too.
        let there = unsafe { core::slice::from_raw_parts(address as *const u8, bytes.len()) };
        bytes.iter_mut().zip(there).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    /// Copies bytes from flash, faster than `read` for many bytes and slower for a few.
    pub(crate) fn read_many(&self, area: &FlashArea, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        let address = area.address(offset, bytes.len(), 1)?;
        // SAFETY: all bytes lie in flash, which is always readable, and it is not programmed during the call, because
        // programming needs this value too. The destination is in RAM.
        unsafe { core::ptr::copy_nonoverlapping(address as *const u8, bytes.as_mut_ptr(), bytes.len()) };
        Ok(())
    }

    /// Programs whole words.
    pub(crate) fn write(&mut self, area: &FlashArea, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        let address = area.address(offset, bytes.len(), 4)?;
        for (word, place) in bytes.as_chunks().0.iter().zip((address..).step_by(4)) {
            self.program(place, u32::from_le_bytes(*word))?;
        }
        self.forget_cached();
        Ok(())
    }

    /// Programs one word and waits for the end: 16 us, at most 100 us. Code in flash stalls during this time.
    ///
    /// `address` must be in flash, outside of the program, and a multiple of four.
    fn program(&mut self, address: u32, word: u32) -> Result<(), Error> {
        self.prepare()?;
        self.0.cr().modify(|_, w| w.psize().psize32().pg().set_bit());
        // SAFETY: the callers give addresses of an area that holds no code and no value of this program.
        unsafe { (address as *mut u32).write_volatile(word) };
        cortex_m::asm::dsb();
        self.wait(PROGRAM_POLLS)?;
        self.end()
    }

    /// Erases a sector and waits for the end: 0.25 s for the smallest sector, 2 s at most.
    pub(crate) fn erase(&mut self, sector: u8) -> Result<(), Error> {
        self.start_erase(sector)?;
        self.wait(ERASE_POLLS)?;
        self.end()
    }

    /// Starts the erase of a sector. The caller calls [`Flash::end`] when the controller is no longer busy.
    pub(crate) fn start_erase(&mut self, sector: u8) -> Result<(), Error> {
        self.prepare()?;
        // SAFETY: SNB takes any sector number.
        self.0.cr().modify(|_, w| unsafe { w.psize().psize32().ser().set_bit().snb().bits(sector) });
        self.0.cr().modify(|_, w| w.strt().set_bit());
        cortex_m::asm::dsb();
        Ok(())
    }

    /// Whether an operation is under way.
    pub(crate) fn is_busy(&self) -> bool {
        self.0.sr().read().bsy().bit_is_set()
    }

    /// Clears old errors and unlocks the controller for one operation.
    fn prepare(&mut self) -> Result<(), Error> {
        self.wait(PROGRAM_POLLS)?;
        // SAFETY: SR takes a 1 for each flag to clear.
        self.0.sr().write(|w| unsafe { w.bits(ERRORS) });
        if self.0.cr().read().lock().bit_is_set() {
            for key in KEYS {
                // SAFETY: these are the keys.
                self.0.keyr().write(|w| unsafe { w.bits(key) });
            }
        }
        Ok(())
    }

    /// After an operation: locks the controller, and returns the error flags as an error.
    pub(crate) fn end(&mut self) -> Result<(), Error> {
        let flags = self.0.sr().read().bits() & ERRORS;
        self.0.cr().write(|w| w.lock().set_bit());
        if flags == 0 { Ok(()) } else { Err(Error::Flags(flags)) }
    }

    /// Waits for the end of the operation under way. An operation that does not end is an error; the controller is then
    /// locked, and the next operation waits for the same flag again.
    fn wait(&self, polls: u32) -> Result<(), Error> {
        if (0..polls).any(|_| !self.is_busy()) {
            return Ok(());
        }
        self.0.cr().write(|w| w.lock().set_bit());
        Err(Error::Busy)
    }

    /// Empties the data cache, which may hold words from before the operation (RM0390, 3.4.2). The cache must be off
    /// for this. The instruction cache holds no line of the areas that are programmed: a running program never writes
    /// its own code, and the bootloader empties both caches before it starts the application. Emptied with each save, it
    /// would slow down every task.
    pub(crate) fn forget_cached(&mut self) {
        let was_on = self.0.acr().read().dcen().bit_is_set();
        self.0.acr().modify(|_, w| w.dcen().clear_bit());
        self.0.acr().modify(|_, w| w.dcrst().set_bit());
        self.0.acr().modify(|_, w| w.dcrst().clear_bit());
        self.0.acr().modify(|_, w| w.dcen().bit(was_on));
    }
}
