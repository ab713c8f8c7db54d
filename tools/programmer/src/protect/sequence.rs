//! The sequence of register accesses that programs the option bytes (RM0390, 3.6.2; RM0090, 3.7.2).

use crate::protect::option_bytes::{OptionBytes, ReadOut};

const FLASH: u32 = 0x4002_3C00;
const OPTKEYR: u32 = FLASH + 0x08;
const SR: u32 = FLASH + 0x0C;
pub(crate) const OPTCR: u32 = FLASH + 0x14;

const KEYS: [u32; 2] = [0x0819_2A3B, 0x4C5D_6E7F];
const OPTLOCK: u32 = 1 << 0;
const OPTSTRT: u32 = 1 << 1;
const BSY: u32 = 1 << 16;

/// The number of tries to wait for the flash. The longest operation, a mass erase, takes 8 s typically and 16 s at most
/// (STM32F446 datasheet, 6.3.12). A try through a probe takes a large part of a second.
const LOOKS: usize = 1000;

/// Access to the registers of the chip, through a probe or in an emulator.
pub trait Registers {
    /// The error of an access.
    type Error;

    /// Reads a register.
    ///
    /// # Errors
    /// The access failed.
    fn read(&mut self, address: u32) -> Result<u32, Self::Error>;

    /// Writes a register.
    ///
    /// # Errors
    /// The access failed.
    fn write(&mut self, address: u32, value: u32) -> Result<(), Self::Error>;
}

/// Why the option bytes were not programmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Error<E> {
    /// A register could not be reached.
    #[error(transparent)]
    Access(E),
    /// Level 2 of the read-out protection, on the chip or in the wanted option bytes.
    #[error("level 2 of the read-out protection cannot be undone; this tool leaves it alone")]
    Final,
    /// SPRMOD is set on the chip or in the wanted option bytes.
    #[error("the chip has its sectors in PCROP mode, which this tool leaves alone")]
    Proprietary,
    /// The keys did not unlock the register.
    #[error("the option bytes stay locked; reset the board and try again")]
    Locked,
    /// The flash stays busy.
    #[error("the flash does not come to an end of what it does")]
    Busy,
    /// The option bytes differ from the wanted ones after programming.
    #[error("afterwards the option bytes are {0}")]
    Differs(OptionBytes),
}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Error<E> {
        Error::Access(error)
    }
}

/// The option bytes of the chip.
///
/// # Errors
/// [`Error::Access`].
pub fn current<R: Registers>(registers: &mut R) -> Result<OptionBytes, Error<R::Error>> {
    Ok(OptionBytes::from_register(registers.read(OPTCR)?))
}

/// Programs the option bytes, and locks them again. For the change from level 1 to level 0 the chip first erases its
/// whole flash.
///
/// # Errors
/// Nothing was changed, except after [`Error::Busy`], [`Error::Differs`], and perhaps [`Error::Access`].
pub fn program<R: Registers>(registers: &mut R, wanted: OptionBytes) -> Result<(), Error<R::Error>> {
    admit(current(registers)?)?;
    admit(wanted)?;
    wait(registers)?;
    for key in KEYS {
        registers.write(OPTKEYR, key)?;
    }
    if registers.read(OPTCR)? & OPTLOCK != 0 {
        return Err(Error::Locked);
    }
    registers.write(OPTCR, wanted.register())?;
    registers.write(OPTCR, wanted.register() | OPTSTRT)?;
    wait(registers)?;
    registers.write(OPTCR, wanted.register() | OPTLOCK)?;
    let found = current(registers)?;
    if found == wanted { Ok(()) } else { Err(Error::Differs(found)) }
}

fn admit<E>(bytes: OptionBytes) -> Result<(), Error<E>> {
    match bytes.read_out() {
        ReadOut::Final => Err(Error::Final),
        _ if bytes.is_proprietary() => Err(Error::Proprietary),
        _ => Ok(()),
    }
}

fn wait<R: Registers>(registers: &mut R) -> Result<(), Error<R::Error>> {
    for _ in 0..LOOKS {
        if registers.read(SR)? & BSY == 0 {
            return Ok(());
        }
    }
    Err(Error::Busy)
}

#[cfg(test)]
mod tests {
    use std::convert::Infallible;

    use super::*;

    /// A chip that is never busy, and notes the written values.
    struct Chip {
        optcr: u32,
        opens: bool,
        busy: bool,
        written: Vec<(u32, u32)>,
    }

    impl Registers for Chip {
        type Error = Infallible;

        fn read(&mut self, address: u32) -> Result<u32, Infallible> {
            Ok(if address == OPTCR { self.optcr } else { u32::from(self.busy) << 16 })
        }

        fn write(&mut self, address: u32, value: u32) -> Result<(), Infallible> {
            self.written.push((address, value));
            match (address, value) {
                (OPTKEYR, key) if key == KEYS[1] && self.opens => self.optcr &= !OPTLOCK,
                (OPTCR, value) if self.optcr & OPTLOCK == 0 => self.optcr = value & !OPTSTRT,
                _ => {}
            }
            Ok(())
        }
    }

    fn chip(optcr: u32) -> Chip {
        Chip { optcr: optcr | OPTLOCK, opens: true, busy: false, written: vec![] }
    }

    const FACTORY: OptionBytes = OptionBytes::FACTORY;

    #[test]
    fn the_sequence_is_that_of_the_manual() {
        let mut chip = chip(FACTORY.register());
        program(&mut chip, FACTORY.with_bootloader(true)).unwrap();
        let expected = [
            (0x4002_3C08, 0x0819_2A3B),
            (0x4002_3C08, 0x4C5D_6E7F),
            (0x4002_3C14, 0x0FFC_AAEC),
            (0x4002_3C14, 0x0FFC_AAEE),
            (0x4002_3C14, 0x0FFC_AAED),
        ];
        assert_eq!(chip.written, expected);
    }

    #[test]
    fn nothing_is_written_to_a_chip_that_is_busy_final_or_in_pcrop_mode() {
        let with = |optcr, busy| Chip { busy, ..chip(optcr) };
        let factory = FACTORY.register();
        let cases = [
            (with(factory, true), Error::Busy),
            (with(0x0FFF_CCEC, false), Error::Final),
            (with(factory | 1 << 31, false), Error::Proprietary),
        ];
        for (mut chip, error) in cases {
            assert_eq!(program(&mut chip, FACTORY.with_bootloader(true)), Err(error));
            assert_eq!(chip.written, []);
        }
    }

    #[test]
    fn level_2_is_never_written() {
        let mut chip = chip(FACTORY.register());
        let wanted = OptionBytes::from_register(0x0FFF_CCEC);
        assert_eq!(program(&mut chip, wanted), Err(Error::Final));
        assert_eq!(chip.written, []);
    }

    #[test]
    fn a_register_that_does_not_open_is_no_success() {
        let mut chip = Chip { opens: false, ..chip(FACTORY.register()) };
        assert_eq!(program(&mut chip, FACTORY.with_bootloader(true)), Err(Error::Locked));
        assert!(chip.written.iter().all(|(address, _)| *address == OPTKEYR));
    }
}
