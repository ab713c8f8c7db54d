//! The crash record in RAM that survives a reset, and the panic handler that writes one.

use core::panic::PanicInfo;
use core::sync::atomic::{AtomicU32, Ordering};

use super::memory;
use crate::crash_record::{Crash, Fault, Place, Sealed, WORDS};

/// At one address in both images (memory.x, RETAINED), and never initialised. `used`, so that the compiler does not
/// take it for zero at the start.
#[used]
#[unsafe(link_section = ".retained")]
static RECORD: [AtomicU32; WORDS] = [const { AtomicU32::new(0) }; WORDS];

/// The crash that ended the last run, and forgets it.
pub fn take() -> Option<Crash> {
    let mut words: Sealed = [0; WORDS];
    for (to, from) in words.iter_mut().zip(&RECORD) {
        *to = from.swap(0, Ordering::Relaxed);
    }
    Crash::open(&words)
}

/// Writes the record and restarts.
pub(crate) fn restart(crash: &Crash) -> ! {
    for (to, from) in RECORD.iter().zip(crash.seal()) {
        to.store(from, Ordering::Relaxed);
    }
    cortex_m::peripheral::SCB::sys_reset()
}

/// Says in the log what happened.
pub fn log(crash: &Crash) {
    match crash {
        Crash::Fault(fault) => log_fault(fault),
        Crash::Panic(place) => {
            defmt::error!("the last run ended in a panic at {=str}:{=u32}", place.file(), place.line());
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

#[panic_handler]
fn panic(info: &PanicInfo) -> ! {
    cortex_m::interrupt::disable();
    let place = info.location().map_or(Place::new("", 0), |at| Place::new(at.file(), at.line()));
    restart(&Crash::Panic(place))
}
