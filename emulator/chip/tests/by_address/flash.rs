//! FLASH as a flash driver uses it, and power cuts.

use canbus::Time;
use chip::{Board, BusFault, Effect, Peripherals, Stm32f4, Variant};

use crate::flash_interface::{
    BSY, CR, EOP, EOPIE, ERRIE, KEYR, KEYS, LOCK, MER, PG, PGAERR, PGPERR, PGSERR, SR, STRT, WRPERR, X32,
    erasure,
};
use crate::support::Rig;

const FLASH_IRQ: u8 = 4;
/// Sector 2, 16 KiB.
const PAGE: u32 = 0x0800_8000;
const PAGE_END: u32 = 0x0800_C000;

fn unlocked() -> Rig {
    let mut rig = Rig::new();
    rig.unlock_flash();
    rig
}

fn word(rig: &Rig, address: u32) -> u32 {
    u32::from_le_bytes([0, 1, 2, 3].map(|n| rig.byte(address + n)))
}

#[test]
fn it_unlocks_with_both_keys_and_locks_again() {
    let mut rig = Rig::new();
    assert_eq!(rig.read(CR), LOCK);
    rig.write(CR, PG);
    assert_eq!(rig.read(CR), LOCK, "a locked register keeps its value");
    let mut rig = unlocked();
    assert_eq!(rig.read(CR), 0);
    rig.write(CR, LOCK);
    assert_eq!(rig.read(CR), LOCK);
}

#[test]
fn a_wrong_key_is_a_bus_error_until_the_next_reset() {
    let mut rig = Rig::new();
    rig.write(KEYR, KEYS[0]);
    let now = rig.now;
    assert_eq!(rig.chip.write(KEYR, 4, 0x1234, now), Err(BusFault));
    assert_eq!(rig.chip.write(KEYR, 4, KEYS[0], now), Err(BusFault));
    rig.chip.reset(false, now);
    rig.unlock_flash();
    assert_eq!(rig.read(CR), 0);
}

#[test]
fn an_erase_takes_its_time_and_stalls_the_core() {
    for (sector, range, millis) in
        [(2, PAGE..PAGE_END, 250), (4, 0x0801_0000..0x0802_0000, 550), (7, 0x0806_0000..0x0808_0000, 1000)]
    {
        let mut rig = unlocked();
        rig.memory.0.extend(range.clone().map(|address| (address, 0x5A)));
        rig.memory.0.insert(range.start - 1, 0x5A);
        rig.erase(sector);
        let end = rig.now + Time::from_millis(millis);
        assert!(rig.effects.contains(&Effect::StallFlash(end)));
        assert_eq!(rig.wait_for_flash(), Time::from_millis(millis));
        assert!(range.clone().all(|address| rig.byte(address) == 0xFF));
        assert_eq!(rig.byte(range.start - 1), 0x5A, "no more than the sector");
    }
}

#[test]
fn programming_clears_bits_and_never_sets_them() {
    let mut rig = unlocked();
    rig.write(CR, PG | X32);
    rig.program(PAGE, &0xFFFF_00FF_u32.to_le_bytes());
    assert_eq!(rig.wait_for_flash(), Time::from_micros(16));
    rig.program(PAGE, &0x0FFF_FFFF_u32.to_le_bytes());
    rig.wait_for_flash();
    assert_eq!(word(&rig, PAGE), 0x0FFF_00FF);
    assert_eq!(rig.read(SR), 0);
}

#[test]
fn every_width_must_match_psize() {
    let bytes = [1, 2, 3, 4, 5, 6, 7, 8];
    for psize in 0..4_u32 {
        for width in [1_usize, 2, 4, 8] {
            let mut rig = unlocked();
            rig.write(CR, PG | psize << 8);
            rig.program(PAGE, &bytes[..width]);
            let matches = width == 1 << psize;
            // A word with PSIZE x64 is the first half of a double word.
            let half = psize == 3 && width == 4;
            assert_eq!(rig.byte(PAGE) == 1, matches, "psize {psize}, width {width}");
            assert_eq!(rig.read(SR) & PGPERR != 0, !matches && !half, "psize {psize}, width {width}");
        }
    }
}

#[test]
fn a_store_over_a_row_of_16_bytes_is_refused() {
    let mut rig = unlocked();
    rig.write(CR, PG | X32);
    rig.program(PAGE + 14, &[0; 4]);
    assert_eq!((rig.read(SR), rig.byte(PAGE + 14)), (PGAERR, 0xFF));
}

#[test]
fn a_double_word_may_come_as_two_words() {
    let mut rig = unlocked();
    rig.write(CR, PG | 3 << 8);
    rig.program(PAGE, &[1, 2, 3, 4]);
    assert_eq!(rig.byte(PAGE), 0xFF);
    rig.program(PAGE + 4, &[5, 6, 7, 8]);
    assert_eq!([word(&rig, PAGE), word(&rig, PAGE + 4)], [0x0403_0201, 0x0807_0605]);
    assert_eq!(rig.chip.flash_mut().operations(), 1);
}

#[test]
fn a_store_without_pg_is_a_sequence_error_that_stays() {
    let mut rig = Rig::new();
    rig.program(PAGE, &[0; 4]);
    assert_eq!((rig.read(SR), rig.byte(PAGE)), (PGSERR, 0xFF), "locked");
    let mut rig = unlocked();
    rig.program(PAGE, &[0; 4]);
    assert_eq!((rig.read(SR), rig.byte(PAGE)), (PGSERR, 0xFF), "no PG");
    rig.write(CR, PG | X32);
    rig.program(PAGE, &[0; 4]);
    assert_eq!((rig.read(SR) & !BSY, rig.byte(PAGE)), (PGSERR, 0), "the flag stays");
    rig.write(SR, PGSERR);
    assert_eq!(rig.read(SR) & !BSY, 0);
}

#[test]
fn a_protected_sector_is_neither_erased_nor_programmed() {
    let mut rig = unlocked();
    rig.chip = Stm32f4::new(Variant::F446, Board { write_protected: 0b100, ..Board::default() });
    rig.unlock_flash();
    rig.memory.0.insert(PAGE, 0x5A);
    rig.erase(2);
    assert_eq!(rig.read(SR), WRPERR);
    rig.write(SR, WRPERR);
    rig.write(CR, PG | X32);
    rig.program(PAGE, &[0; 4]);
    assert_eq!((rig.read(SR), rig.byte(PAGE)), (WRPERR, 0x5A));
    rig.write(SR, WRPERR);
    rig.write(CR, MER | STRT);
    assert_eq!(rig.read(SR), WRPERR, "nor with all the others");
}

#[test]
fn end_of_operation_raises_its_interrupt_when_enabled() {
    let mut rig = unlocked();
    rig.write(CR, erasure(2) | EOPIE);
    rig.write(CR, erasure(2) | EOPIE | STRT);
    let start = rig.now;
    assert_eq!(rig.run_to_irq(FLASH_IRQ, Time::from_millis(500)), Some(start + Time::from_millis(250)));
    rig.write(SR, EOP);
    assert!(!rig.irq(FLASH_IRQ));
    rig.write(CR, PG | X32 | ERRIE);
    rig.program(PAGE, &[0; 2]);
    assert!(rig.irq(FLASH_IRQ), "OPERR");
}

#[test]
fn a_cut_while_programming_leaves_some_bits_and_repeats() {
    let torn = || {
        let mut rig = unlocked();
        rig.write(CR, PG | X32);
        rig.chip.flash_mut().cut_power_at_operation(3);
        for n in 0..3 {
            rig.program(PAGE + 4 * n, &0_u32.to_le_bytes());
            rig.wait(Time::from_micros(20));
        }
        assert!(rig.effects.contains(&Effect::PowerCut));
        [0, 4, 8].map(|n| word(&rig, PAGE + n))
    };
    let words = torn();
    assert_eq!(words[..2], [0, 0], "operations before the cut are whole");
    assert!(words[2] != 0 && words[2] != u32::MAX, "{:#x}", words[2]);
    assert_eq!(words, torn());
}

#[test]
fn a_cut_while_erasing_leaves_part_of_the_sector() {
    let mut rig = unlocked();
    rig.memory.0.extend((PAGE..PAGE_END).map(|address| (address, 0)));
    rig.chip.flash_mut().cut_power_at_operation(1);
    rig.erase(2);
    assert!(!rig.effects.contains(&Effect::PowerCut));
    rig.wait(Time::from_millis(125));
    assert!(rig.effects.contains(&Effect::PowerCut));
    let erased = (PAGE..PAGE_END).filter(|&address| rig.byte(address) == 0xFF).count();
    let kept = (PAGE..PAGE_END).filter(|&address| rig.byte(address) == 0).count();
    assert!(erased >= 2048 && kept >= 2048, "{erased} erased, {kept} kept");
}

#[test]
fn a_reset_while_erasing_tears_the_sector_too() {
    let mut rig = unlocked();
    rig.memory.0.extend((PAGE..PAGE_END).map(|address| (address, 0)));
    rig.erase(2);
    rig.wait(Time::from_millis(10));
    rig.chip.reset(false, rig.now);
    rig.read(SR);
    assert!((PAGE..PAGE_END).any(|address| rig.byte(address) == 0));
    assert!((PAGE..PAGE_END).any(|address| rig.byte(address) == 0xFF));
    rig.wait(Time::from_millis(500));
    assert!((PAGE..PAGE_END).any(|address| rig.byte(address) == 0), "it does not go on");
}

#[test]
fn the_f407_has_twelve_sectors() {
    let mut rig = Rig::with(Variant::F407);
    rig.unlock_flash();
    rig.memory.0.insert(0x080F_FFFF, 0);
    rig.erase(11);
    rig.wait_for_flash();
    assert_eq!(rig.byte(0x080F_FFFF), 0xFF);
}
