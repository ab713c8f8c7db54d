//! Durations of the flash operations: typical times of the data sheets DS10693 and DS8626 (flash memory programming).

use canbus::Time;

/// Programming of a byte, half-word, word or double word.
pub(super) const PROGRAM: Time = Time::from_micros(16);

const KIB: u32 = 1024;

/// The erase of a sector; `psize` is the parallelism as FLASH_CR codes it.
pub(super) fn sector_erase(size: u32, psize: u32) -> Time {
    let millis = match size / KIB {
        16 => [400, 300, 250, 230],
        64 => [1200, 700, 550, 490],
        _ => [2000, 1300, 1000, 875],
    };
    Time::from_millis(millis[psize as usize & 3])
}

/// The erase of the whole array; twice the size takes twice as long.
pub(super) fn mass_erase(size: u32, psize: u32) -> Time {
    let millis_of_512_kib = [8000, 5500, 4000, 3500][psize as usize & 3];
    Time::from_millis(millis_of_512_kib * u64::from(size / (512 * KIB)))
}
