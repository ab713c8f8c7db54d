//! The crash record, and what writes one at a panic.

use core::panic::Location;

use super::{memory, retained};
use crate::crash_record::{Crash, Fault, Place, WORDS};

/// The crash that ended the last run, and forgets it.
pub fn take() -> Option<Crash> {
    let crash = Crash::open(&retained::crash());
    retained::set_crash([0; WORDS]);
    crash
}

/// Whether the last run ended in a crash that nobody has taken yet.
pub(super) fn is_recorded() -> bool {
    Crash::open(&retained::crash()).is_some()
}

/// Writes the record and restarts.
pub(crate) fn restart(crash: &Crash) -> ! {
    retained::set_crash(crash.seal());
    cortex_m::peripheral::SCB::sys_reset()
}

/// Says in the log what happened.
pub fn log(crash: &Crash) {
    match crash {
        Crash::Fault(fault) => log_fault(fault),
        Crash::Panic(place) => {
            defmt::error!("the last run ended in a panic at {=str}:{=u32}", place.file(), place.line());
        }
        Crash::Clock => defmt::error!("the last run ended when the clock on OSC_IN failed"),
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

/// What the panic handler of an image does. It is not the handler itself because one that uses the place is linked with the
/// names of all places, for which the bootloader has no room.
pub fn panicked(place: Option<&Location<'_>>) -> ! {
    cortex_m::interrupt::disable();
    let place = place.map_or(Place::new("", 0), |at| Place::new(at.file(), at.line()));
    restart(&Crash::Panic(place))
}
