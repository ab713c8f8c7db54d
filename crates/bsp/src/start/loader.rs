//! Bring-up of the board for the bootloader, in two steps: the parts for the decision at every start, and the bus.

use stm32f4xx_hal::pac::{CAN1, Peripherals, RCC, TIM2};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Rcc;
use update::Reset;

use crate::can::controller::Controller;
use crate::can::transmit::Transmitter;
use crate::chip::{confinement, crash, errata};
use crate::flash::controller::Flash;
use crate::losses::Losses;
use crate::pins::led::Led;
use crate::power::reset_cause::ResetCause;
use crate::start::clock_tree;
use crate::time::time_base::{self, Alarm, TimeInterrupt};
use crate::{ProgramFlash, StartUpWatchdog};

/// Clock, watchdog and flash.
pub struct Loader {
    /// Why the chip was reset. The flags are left for the application.
    pub reset: Reset,
    /// Already running.
    pub watchdog: StartUpWatchdog,
    /// The flash that an update uses.
    pub flash: ProgramFlash,
    /// The parts for the bus, if the bootloader stays.
    pub rest: Rest,
}

/// Parts that are not started yet.
pub struct Rest {
    rcc: Rcc,
    can: CAN1,
    timer: TIM2,
}

/// The parts for the bus.
pub struct Bus {
    /// The interrupt of the time base.
    pub time: TimeInterrupt,
    /// The alarm of the main loop.
    pub alarm: Alarm,
    /// The CAN controller, not yet on the bus.
    pub can: Controller,
    /// The transmit mailboxes.
    pub transmitter: Transmitter,
    /// The status LED.
    pub led: Led,
}

impl Loader {
    /// The watchdog comes first, so that whatever hangs ends in a reset. Next, all memory but the
    /// code of the bootloader is made non-executable, before anything is examined. The clock is raised because the CRC
    /// of the application takes nine times as long at the 16 MHz of a reset.
    #[must_use]
    pub fn start(device: Peripherals, is_for_development: bool) -> Loader {
        let watchdog = StartUpWatchdog::new(device.IWDG, &device.DBGMCU);
        confinement::begin();
        errata::keep_debugger(&device.DBGMCU, is_for_development);
        let reset = reset(&device.RCC);
        clock_tree::raise(&device.RCC, &device.FLASH);
        let rcc = device.RCC.constrain();
        let flash = ProgramFlash::new(Flash::new(device.FLASH));
        let rest = Rest { rcc, can: device.CAN1, timer: device.TIM2 };
        Loader { reset, watchdog, flash, rest }
    }
}

impl Rest {
    /// The bootloader stays: starts time base, CAN controller and LED, and clears the cause of the reset.
    #[must_use]
    pub fn start(mut self, losses: &'static Losses) -> Bus {
        self.rcc.csr().modify(|_, w| w.rmvf().set_bit());
        let (time, [alarm, _]) = time_base::start(self.timer, &mut self.rcc);
        let led = Led::new(&self.rcc);
        let (can, transmitter) = Controller::new(self.can, losses, &mut self.rcc);
        Bus { time, alarm, can, transmitter, led }
    }

    /// The application starts: restores the reset state of the clocks.
    pub fn stop(self) {
        clock_tree::lower(&self.rcc);
    }
}

fn reset(rcc: &RCC) -> Reset {
    let cause = ResetCause::from_csr(rcc.csr().read().bits());
    match cause {
        _ if cause.is_unexpected() || crash::is_recorded() => Reset::Crash,
        ResetCause::PowerOn | ResetCause::BrownOut => Reset::Power,
        _ => Reset::Asked,
    }
}
