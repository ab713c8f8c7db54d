//! A requested reset restarts the program. RAM keeps its content, so the second run knows of the first.
#![no_std]
#![no_main]

use core::mem::MaybeUninit;

use cortex_m_rt::entry;
use mechanics_images::{expect, finish};

const MARK: u32 = 0x5EC0_11FE;

#[unsafe(link_section = ".uninit.MARK")]
static mut LIFE: MaybeUninit<u32> = MaybeUninit::uninit();

#[entry]
fn main() -> ! {
    let life = (&raw mut LIFE).cast::<u32>();
    let before = unsafe { life.read_volatile() };
    unsafe { life.write_volatile(MARK) };
    if before == MARK {
        let masked = cortex_m::register::basepri::read();
        finish(expect(masked == 0, 1));
    }
    unsafe { cortex_m::register::basepri::write(0x80) };
    cortex_m::peripheral::SCB::sys_reset()
}
