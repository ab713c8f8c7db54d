//! Writes the crash record at a crash, and reads it at the next start.

use core::panic::Location;

use crate::chip::crash_record::{Crash, Fault, Place, WORDS};
use crate::chip::{memory, retained};

/// Takes the crash that ended the last run; a second call returns none.
pub fn take() -> Option<Crash> {
    let crash = Crash::open(&retained::crash());
    retained::set_crash([0; WORDS]);
    crash
}

/// Whether the last run ended in a crash that has not been taken yet.
pub(crate) fn is_recorded() -> bool {
    Crash::open(&retained::crash()).is_some()
}

/// Writes the record and restarts.
#[allow(clippy::inline_always)]
#[inline(always)]
pub(crate) fn restart(crash: &Crash) -> ! {
    cortex_m::interrupt::disable();
    retained::set_crash(crash.seal());
    cortex_m::peripheral::SCB::sys_reset()
}

/// Writes the crash to the log.
pub fn log(crash: &Crash) {
    match crash {
        Crash::Fault(fault) => log_fault(fault),
        Crash::Panic(place) => {
            defmt::error!("the last run ended in a panic at {=str}:{=u32}", place.file(), place.line());
        }
        Crash::Clock => defmt::error!("the last run ended when the clock on OSC_IN failed"),
        Crash::Interrupt(number) => {
            defmt::error!("the last run ended in interrupt {=i16}, which nobody serves", number);
        }
    }
}

fn log_fault(fault: &Fault) {
    let Fault { pc, lr, sp, cfsr, hfsr, address } = fault;
    if *sp < memory::stack().start {
        defmt::error!("the last run ended in a stack overflow: sp {=u32:#010x}", sp);
    }
    defmt::error!(
        "the last run ended in a fault at {=u32:#010x}, lr {=u32:#010x}, sp {=u32:#010x}",
        pc,
        lr,
        sp
    );
    defmt::error!("CFSR {=u32:#010x}, HFSR {=u32:#010x}, address {=u32:#010x}", cfsr, hfsr, address);
}

/// For the panic handler of an image. This crate has no handler of its own, because a handler that uses the location of
/// a panic is linked with the names of all source files, for which the bootloader has no room.
pub fn panicked(place: Option<&Location<'_>>) -> ! {
    let place = place.map_or(Place::new("", 0), |at| Place::new(at.file(), at.line()));
    restart(&Crash::Panic(place))
}
