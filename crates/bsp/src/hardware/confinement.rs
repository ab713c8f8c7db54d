//! The memory protection unit (PM0214, 4.2) while the bootloader runs: nothing but the bootloader's own code is executed. What was
//! received, and an application that nobody has looked at yet, are data, also for a processor that has lost its way.

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// RBAR: the number of the region stands in the lowest bits.
const VALID: u32 = 1 << 4;
/// RASR: normal memory that everybody may read and write, cached as the default map has it; the region counts.
const NORMAL: u32 = 0b011 << 24 | 1 << 17 | 1;
/// RASR: no code.
const XN: u32 = 1 << 28;
/// CTRL: the unit works, and the default map holds beside the regions: peripherals never have code.
const ENABLE: u32 = 0b101;

/// Base and number, then attributes. The later region goes before.
const REGIONS: [[u32; 2]; 2] = [
    // Flash and RAM, all of the first gigabyte.
    [VALID, XN | NORMAL | 29 << 1],
    // Where the code of the bootloader is (bootloader.x asserts it): 32 KiB behind the stack, the parts 3 to 6 of eight in 64 KiB.
    [0x2000_0000 | VALID | 1, NORMAL | 0b1000_0111 << 8 | 15 << 1],
];

/// From now on only the bootloader runs. To be called from the code that runs in RAM.
pub(super) fn begin() {
    // SAFETY: no one else has the unit, and what goes on lies in the second region.
    let mpu = unsafe { &*MPU::PTR };
    let [[first, of_first], [second, of_second]] = REGIONS;
    // SAFETY: the unit is off: nothing follows from a region yet.
    unsafe {
        mpu.rbar.write(first);
        mpu.rasr.write(of_first);
        mpu.rbar.write(second);
        mpu.rasr.write(of_second);
    }
    switch(ENABLE);
}

/// From now on everything runs.
pub(super) fn end() {
    switch(0);
}

#[inline(never)]
fn switch(control: u32) {
    // SAFETY: data goes everywhere with and without the unit.
    unsafe { (*MPU::PTR).ctrl.write(control) };
    dsb();
    isb();
}
