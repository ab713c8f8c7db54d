//! The bootloader: it starts the application when the slot holds one that can be started.
//!
//! The update over CAN (CiA 302-3) is not part of it yet. Without an application it says so in the log and on the LED, and
//! waits for a debugger. It does not clear the reset flags: the application reads why the chip was reset.
#![no_std]
#![no_main]

use bsp::led::Led;
use bsp::{application, board, memory, pac};
use cortex_m::delay::Delay;
use cortex_m_rt::entry;

#[entry]
fn main() -> ! {
    let (Some(core), Some(device)) = (cortex_m::Peripherals::take(), pac::Peripherals::take()) else {
        unreachable!("nothing took the peripherals before");
    };
    if let Some(vectors) = application::vectors() {
        application::start(&core.SCB, vectors);
    }
    defmt::error!("there is no application at {=u32:#010x}", memory::application().start);
    signal(&mut board::led(device), &mut Delay::new(core.SYST, board::RESET_CLOCK_HZ))
}

/// Two short flashes a second: no application.
fn signal(led: &mut Led, delay: &mut Delay) -> ! {
    loop {
        for (on, milliseconds) in [(true, 100), (false, 100), (true, 100), (false, 700)] {
            led.set(on);
            delay.delay_ms(milliseconds);
        }
    }
}
