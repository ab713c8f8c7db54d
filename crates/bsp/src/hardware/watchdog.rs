//! The independent watchdog, which runs from its own oscillator and cannot be stopped.

use stm32f4xx_hal::pac::{DBGMCU, IWDG};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::watchdog::IndependentWatchdog;

use crate::supervision::{Part, Supervision};

/// Nominal time-out in milliseconds. The oscillator has 17 to 47 kHz instead of 32 kHz (STM32F446 datasheet, 6.3.10),
/// so the real time-out is 136 to 376 ms. The supervised parts report at least every 20 ms.
const TIMEOUT_MS: u32 = 200;

/// Nominal time-out of the start-up in milliseconds, in reality 2 to 6 s: the parameter store may erase two sectors of
/// 16 KiB during the start-up, which takes up to 0.8 s each.
const START_UP_MS: u32 = 3_000;

/// The value of KR that restarts the countdown.
const RELOAD: u16 = 0xAAAA;

/// The watchdog while the node starts, with the long time-out.
pub struct StartUpWatchdog(IndependentWatchdog);

impl StartUpWatchdog {
    /// Starts the watchdog. A debugger that halts the core halts the watchdog too.
    pub(crate) fn new(iwdg: IWDG, debug: &DBGMCU) -> StartUpWatchdog {
        let mut watchdog = IndependentWatchdog::new(iwdg);
        watchdog.stop_on_debug(debug, true);
        watchdog.start(START_UP_MS.millis());
        StartUpWatchdog(watchdog)
    }

    /// Restarts the countdown. For the bootloader, whose single loop is alive if it calls this.
    pub fn feed(&mut self) {
        self.0.feed();
    }

    /// Ends the start-up: from now on all parts must report.
    #[must_use]
    pub fn supervise(mut self) -> Watchdog {
        self.0.start(TIMEOUT_MS.millis());
        Watchdog { supervision: Supervision::new() }
    }
}

/// The watchdog of the running node. It is fed once all [`Part`]s have made progress.
pub struct Watchdog {
    supervision: Supervision,
}

impl Watchdog {
    /// Takes note that `part` has made progress.
    pub fn progress(&self, part: Part) {
        if self.supervision.progress(part) {
            // SAFETY: the peripheral was given to `StartUpWatchdog`. Writing the key is one store, at any priority.
            unsafe { (*IWDG::ptr()).kr().write(|w| w.key().bits(RELOAD)) };
        }
    }
}
