//! The option bytes, as `cargo xtask protect` programs them.

use canbus::Time;
use chip::{BusFault, Peripherals};
use programmer::protect::{Error, OptionBytes, ReadOut, Registers, current, program};

use crate::flash_interface::{CR, FLASH, LOCK, PG, SR, STRT, WRPERR, X32, erasure};
use crate::support::Rig;

/// First words of sectors 0, 1 and 4: the bootloader, and the application.
const BOOTLOADER: [(u32, u32); 2] = [(0, 0x0800_0000), (1, 0x0800_4000)];
const APPLICATION: (u32, u32) = (4, 0x0801_0000);
const LEVEL_2: u32 = 0x0FFF_CCEC;

/// The access of a debug probe; each access takes 20 ms.
impl Registers for Rig {
    type Error = BusFault;

    fn read(&mut self, address: u32) -> Result<u32, BusFault> {
        self.wait(Time::from_millis(20));
        Ok(Rig::read(self, address))
    }

    fn write(&mut self, address: u32, value: u32) -> Result<(), BusFault> {
        self.wait(Time::from_millis(20));
        self.chip.write(address, 4, value, self.now)
    }
}

/// The error flags after an erase of a sector and after programming a word at its start.
fn erase_and_program(rig: &mut Rig, (sector, start): (u32, u32)) -> [u32; 2] {
    rig.unlock_flash();
    Rig::write(rig, CR, erasure(sector) | STRT);
    let erase = settled(rig);
    Rig::write(rig, CR, PG | X32);
    rig.program(start, &[0; 4]);
    let program = settled(rig);
    Rig::write(rig, CR, LOCK);
    [erase, program]
}

/// Waits for the end of the operation and clears its error flags, which are returned.
fn settled(rig: &mut Rig) -> u32 {
    rig.wait_for_flash();
    let flags = Rig::read(rig, SR);
    Rig::write(rig, SR, flags);
    flags
}

#[test]
fn a_protected_bootloader_is_neither_erased_nor_programmed_and_the_application_still_is() {
    let mut rig = Rig::new();
    assert_eq!(current(&mut rig), Ok(OptionBytes::FACTORY));
    program(&mut rig, OptionBytes::FACTORY.with_bootloader(true)).unwrap();
    for power in [false, true] {
        for (sector, start) in BOOTLOADER {
            rig.memory.0.insert(start, 0x5A);
            assert_eq!(erase_and_program(&mut rig, (sector, start)), [WRPERR; 2], "sector {sector}");
            assert_eq!(rig.byte(start), 0x5A);
        }
        rig.memory.0.insert(APPLICATION.1, 0x5A);
        assert_eq!(erase_and_program(&mut rig, APPLICATION), [0; 2]);
        assert_eq!(rig.byte(APPLICATION.1), 0, "erased and programmed");
        rig.chip.reset(power, rig.now);
        assert!(current(&mut rig).unwrap().keeps_bootloader(), "it survives");
    }
    program(&mut rig, OptionBytes::FACTORY).unwrap();
    assert_eq!(erase_and_program(&mut rig, BOOTLOADER[0]), [0; 2], "there is a way back");
}

#[test]
fn the_way_back_from_level_1_erases_everything() {
    let mut rig = Rig::new();
    let kept = OptionBytes::FACTORY.with_bootloader(true);
    program(&mut rig, kept.with_read_out(true)).unwrap();
    assert_eq!(current(&mut rig).unwrap().read_out(), ReadOut::Protected);
    for (_, start) in [BOOTLOADER[0], APPLICATION] {
        rig.memory.0.insert(start, 0x5A);
    }
    program(&mut rig, kept.with_read_out(true).with_bootloader(false)).unwrap();
    assert_eq!(rig.byte(APPLICATION.1), 0x5A, "another option at the same level erases nothing");
    program(&mut rig, kept).unwrap();
    assert_eq!([BOOTLOADER[0], APPLICATION].map(|(_, start)| rig.byte(start)), [0xFF; 2]);
}

#[test]
fn a_chip_at_level_2_is_left_alone() {
    let mut rig = Rig::new();
    for (address, value) in [(0x08, 0x0819_2A3B), (0x08, 0x4C5D_6E7F), (0x14, LEVEL_2 | 2)] {
        Rig::write(&mut rig, FLASH + address, value);
    }
    assert_eq!(current(&mut rig).unwrap().read_out(), ReadOut::Final);
    assert_eq!(program(&mut rig, OptionBytes::FACTORY), Err(Error::Final));
    Rig::write(&mut rig, FLASH + 0x14, OptionBytes::FACTORY.register() | 2);
    assert_eq!(current(&mut rig).unwrap().read_out(), ReadOut::Final, "for ever");
}
