//! The independent watchdog, which runs from its own oscillator and cannot be stopped.
//!
//! The driver of stm32f4xx-hal is not used: its choice of the prescaler makes each time-out above 28 ms count in steps of
//! 8 ms, and the prescaler must be known where the time-out of the running node changes.
#![expect(unsafe_code, reason = "registers")]

use stm32f4xx_hal::pac::{DBGMCU, IWDG};

use crate::policy::supervision::{Part, Supervision};

/// A time-out: PR, and the count of RLR for each nominal millisecond. The oscillator has nominally 32 kHz.
#[derive(Clone, Copy)]
struct TimeOut {
    prescaler: u8,
    count: u16,
}

impl TimeOut {
    /// A count each 0.25 ms (divided by 8): up to 1 s.
    const fn short(milliseconds: u16) -> TimeOut {
        assert!(milliseconds < 1024, "RLR has 12 bits");
        TimeOut { prescaler: 1, count: 4 * milliseconds - 1 }
    }

    /// A count each millisecond (divided by 32): up to 4 s.
    const fn long(milliseconds: u16) -> TimeOut {
        assert!(milliseconds <= 4096, "RLR has 12 bits");
        TimeOut { prescaler: 3, count: milliseconds - 1 }
    }
}

/// The running node. The oscillator has 17 to 47 kHz (STM32F446 datasheet, 6.3.10), so the real time-out is 136 to 376 ms.
/// The supervised parts report at least every 20 ms.
const RUNNING: TimeOut = TimeOut::short(200);

/// The start-up, in reality 2 to 5.6 s: the parameter store may erase two sectors of 16 KiB during the start-up, which takes
/// up to 0.8 s each.
const START_UP: TimeOut = TimeOut::long(3_000);

/// While a flash page is erased, in reality 690 ms to 1.9 s: the erase takes up to 0.5 s.
const PAUSE: TimeOut = TimeOut::short(1_023);

/// Values of KR: restarts the countdown, unlocks the other registers, starts the watchdog (RM0390, 20.4.1).
const RELOAD: u16 = 0xAAAA;
const UNLOCK: u16 = 0x5555;
const START: u16 = 0xCCCC;
/// Number of reads of SR for five cycles of the oscillator, after which a new value is in force (RM0390, 20.4.3).
const UPDATE_POLLS: u32 = 1 << 14;

/// The watchdog while the node starts, with the long time-out.
pub struct StartUpWatchdog(());

impl StartUpWatchdog {
    /// Starts the watchdog. A debugger that halts the core halts the watchdog too.
    pub(crate) fn new(watchdog: IWDG, debug: &DBGMCU) -> StartUpWatchdog {
        debug.apb1_fz().modify(|_, w| w.dbg_iwdg_stop().set_bit());
        // SAFETY: this is the key.
        watchdog.kr().write(|w| unsafe { w.key().bits(START) });
        set_time_out(START_UP);
        StartUpWatchdog(())
    }

    /// Restarts the countdown. For the bootloader, whose single loop is alive if it calls this.
    pub fn feed(&mut self) {
        reload();
    }

    /// Ends the start-up: from now on all parts must report.
    #[must_use]
    pub fn supervise(self) -> Watchdog {
        set_time_out(RUNNING);
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
            reload();
        }
    }

    /// Does something that stops all parts for up to 0.5 s: the erase of a flash page.
    pub fn extend<R>(&self, pause: impl FnOnce() -> R) -> R {
        set_time_out(PAUSE);
        let result = pause();
        set_time_out(RUNNING);
        result
    }
}

/// Restarts the countdown. One store, at any priority.
fn reload() {
    // SAFETY: the peripheral was given to `StartUpWatchdog`, and this is the key.
    unsafe { (*IWDG::ptr()).kr().write(|w| w.key().bits(RELOAD)) };
}

/// Changes the time-out, and restarts the countdown. Until a new value is in force, the watchdog reloads the one before, and
/// ignores another one.
#[inline(never)]
fn set_time_out(TimeOut { prescaler, count }: TimeOut) {
    // SAFETY: the peripheral was given to `StartUpWatchdog`. Only the task of the lowest priority comes here; the others
    // write nothing but KR, and not between the three writes below.
    let watchdog = unsafe { &*IWDG::ptr() };
    let is_updated = || (0..UPDATE_POLLS).any(|_| watchdog.sr().read().bits() == 0);
    is_updated();
    cortex_m::interrupt::free(|_| {
        // SAFETY: the values are the key and a prescaler.
        unsafe {
            watchdog.kr().write(|w| w.key().bits(UNLOCK));
            watchdog.pr().write(|w| w.pr().bits(prescaler));
        }
        watchdog.rlr().write(|w| w.rl().set(count));
    });
    is_updated();
    reload();
}
