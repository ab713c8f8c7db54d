//! Bring-up of the whole board in one place: clocks, pins, and the owner of each peripheral.
#![expect(unsafe_code, reason = "registers")]

use core::sync::atomic::Ordering;

use stm32f4xx_hal::dma::StreamsTuple;
use stm32f4xx_hal::pac::{FLASH, Peripherals, RCC};
use stm32f4xx_hal::prelude::*;

use crate::ParameterFlash;
use crate::analog::sampling;
use crate::can::controller::Controller;
use crate::can::transmit::Transmitter;
use crate::chip::errata;
use crate::chip::observations::SEEN;
use crate::chip::retained;
use crate::flash::controller::Flash;
use crate::front_end::FrontEnd;
use crate::losses::Losses;
use crate::pins::digital::{Buttons, Lamps};
use crate::pins::idle_pins;
use crate::pins::led::{Indicators, Led};
use crate::position::encoder;
use crate::position::ssi::{self, Ssi};
use crate::power::backup::BackupMemory;
use crate::power::backup_copies::BackupState;
use crate::power::reset_cause::ResetCause;
use crate::start::{clock_tree, self_test};
use crate::time::time_base::{self, Alarm, TimeInterrupt};
use crate::watchdog::StartUpWatchdog;

/// All parts of the board that the application uses.
pub struct Board {
    /// Why the chip was reset.
    pub reset_cause: ResetCause,
    /// Already running, with the long time-out of the start-up.
    pub watchdog: StartUpWatchdog,
    /// The interrupt of the time base.
    pub time: TimeInterrupt,
    /// The alarms of process data and services.
    pub alarms: [Alarm; 2],
    /// The CAN controller, not yet on the bus.
    pub can: Controller,
    /// The transmit mailboxes.
    pub transmitter: Transmitter,
    /// The pages of the parameter store.
    pub parameters: ParameterFlash,
    /// The analogue inputs and the incremental encoder, ready to start.
    pub front_end: FrontEnd,
    /// The absolute encoder.
    pub ssi: Ssi,
    /// The backup SRAM.
    pub backup: BackupMemory,
    /// Content of the backup SRAM at the start.
    pub backup_state: BackupState,
    /// The digital inputs.
    pub buttons: Buttons,
    /// The digital outputs.
    pub lamps: Lamps,
    /// The status LED.
    pub led: Led,
    /// The indicators of CiA 303-3.
    pub indicators: Indicators,
}

impl Board {
    /// Starts everything but the bus and the sampling. The watchdog comes first, so that whatever hangs ends in a reset. Later losses of hardware events are counted in `losses`.
    #[must_use]
    pub fn start(device: Peripherals, losses: &'static Losses) -> Board {
        self_test::begin();
        let watchdog = StartUpWatchdog::new(device.IWDG, &device.DBGMCU);
        errata::keep_debugger(&device.DBGMCU, retained::is_development());
        clock_tree::raise(&device.RCC, &device.FLASH);
        self_test::note_clock();
        let reset_cause = reset_cause(&device.RCC);
        let mut rcc = device.RCC.constrain();
        self_test::note_lsi(&mut rcc);
        let (time, alarms) = time_base::start(device.TIM2, &mut rcc);
        let gpioa = device.GPIOA.split(&mut rcc);
        let gpiob = device.GPIOB.split(&mut rcc);
        let gpioc = device.GPIOC.split(&mut rcc);
        let (mut can, transmitter) = Controller::new(device.CAN1, losses, &mut rcc);
        self_test::note_loop_back(&mut can);
        let analogue = sampling::Parts {
            adc: device.ADC1,
            common: device.ADC_COMMON,
            dma: device.DMA2,
            timer: device.TIM3,
            pressure: gpioa.pa0.into_analog(),
            supply: gpioa.pa1.into_analog(),
            thermistor: gpioc.pc2.into_analog(),
        };
        let streams = StreamsTuple::new(device.DMA1, &mut rcc);
        let counter = encoder::Parts {
            timer: device.TIM4,
            at_scan: streams.2,
            at_index: streams.5,
            index: gpiob.pb5,
            a: gpiob.pb6,
            b: gpiob.pb7,
        };
        let front_end = FrontEnd::new(analogue, counter, losses, &mut rcc);
        let absolute = ssi::Parts {
            spi: device.SPI2,
            receive: streams.3,
            send: streams.4,
            clock: gpiob.pb13,
            data: gpiob.pb14,
        };
        let ssi = Ssi::new(absolute, losses, &mut rcc);
        let (backup, backup_state) = BackupMemory::open(device.PWR, device.CRC, losses, &mut rcc);
        let (buttons, lamps, led) = (Buttons::new(&rcc), Lamps::new(&rcc), Led::new(&rcc));
        let indicators = Indicators::new(&rcc);
        idle_pins::make_analogue(&rcc);
        let parameters = ParameterFlash::new(Flash::new(device.FLASH), losses);
        Board {
            reset_cause,
            watchdog,
            time,
            alarms,
            can,
            transmitter,
            parameters,
            front_end,
            ssi,
            backup,
            backup_state,
            buttons,
            lamps,
            led,
            indicators,
        }
    }
}

/// Reads and clears the flags, so that the next reset shows only its own cause.
fn reset_cause(rcc: &RCC) -> ResetCause {
    let flags = rcc.csr().read().bits();
    SEEN.reset_flags.store(flags, Ordering::Relaxed);
    let cause = ResetCause::from_csr(flags);
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    cause
}

/// The brown-out level of the option bytes (BOR_LEV; RM0390, 3.6.1): the supply in millivolts below which the chip is
/// held in reset.
#[must_use]
pub fn brown_out_level() -> u16 {
    // SAFETY: a read of a register that only the loading of the option bytes changes.
    match unsafe { (*FLASH::ptr()).optcr().read().bor_lev().bits() } {
        0 => 2700,
        1 => 2400,
        2 => 2100,
        _ => 1700,
    }
}
