//! Memory protection unit (PM0214, 4.2) while the bootloader runs: only the bootloader's own code can be executed.
//! Received data, and an application that is not verified yet, cannot be executed, even if the processor takes a wrong
//! branch.
#![expect(unsafe_code, reason = "registers of the MPU")]

use cortex_m::asm::{dsb, isb};
use cortex_m::peripheral::MPU;

/// RBAR: the region number is in the lowest bits.
const VALID: u32 = 1 << 4;
/// RASR: normal memory with full read and write access, cached as in the default map; region enabled.
const NORMAL: u32 = 0b011 << 24 | 1 << 17 | 1;
/// RASR: no execution.
const XN: u32 = 1 << 28;
/// CTRL: the unit is on, and the default map applies outside of the regions, where peripherals are never executable.
const ENABLE: u32 = 0b101;

/// Base and number, then attributes. The later region takes precedence.
const REGIONS: [[u32; 2]; 2] = [
    // Flash and RAM: the whole first gigabyte.
    [VALID, XN | NORMAL | 29 << 1],
    // The code of the bootloader (asserted in bootloader.x): 32 KiB behind the stack, the parts 3 to 6 of eight in 64
    // KiB.
    [0x2000_0000 | VALID | 1, NORMAL | 0b1000_0111 << 8 | 15 << 1],
];

/// Makes only the bootloader's code executable. To be called from code in RAM.
pub(crate) fn begin() {
    // SAFETY: no other code uses the unit, and the running code lies in the second region.
    let mpu = unsafe { &*MPU::PTR };
    let [[first, of_first], [second, of_second]] = REGIONS;
    // SAFETY: the unit is off, so the regions have no effect yet.
    unsafe {
        mpu.rbar.write(first);
        mpu.rasr.write(of_first);
        mpu.rbar.write(second);
        mpu.rasr.write(of_second);
    }
    switch(ENABLE);
}

/// Makes all memory executable again.
pub(crate) fn end() {
    switch(0);
}

#[inline(never)]
fn switch(control: u32) {
    // SAFETY: data accesses work with and without the unit.
    unsafe { (*MPU::PTR).ctrl.write(control) };
    dsb();
    isb();
}
