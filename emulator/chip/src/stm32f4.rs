//! The chip: its peripherals, wired together.

use std::collections::VecDeque;

use canbus::Time;

use crate::adc::{Adc, AdcCommon};
use crate::backup_ram::BackupRam;
use crate::board::Board;
use crate::can::{BxCan, DualCan};
use crate::clocks::{Clocks, times};
use crate::crc_unit::CrcUnit;
use crate::dbgmcu::Dbgmcu;
use crate::dma::Dma;
use crate::exti::Exti;
use crate::flash::Flash;
use crate::gpio::{Gpio, Outside};
use crate::iwdg::Iwdg;
use crate::loss::{Loss, Losses};
use crate::map::{SPIS, TIMERS};
use crate::peripherals::{Effect, IrqLines};
use crate::plant::Plant;
use crate::pwr::Pwr;
use crate::rcc::{Cause, Rcc};
use crate::rules::Rules;
use crate::spi::{Spi, Ssi, SsiFormat};
use crate::syscfg::Syscfg;
use crate::timer::Timer;
use crate::unmodelled::{Record, Unmodelled};
use crate::variant::Variant;

/// The HCLK that a read of the flash allows for each wait state and one more, by the supply in volts.
const PER_WAIT_STATE: [(f64, u64); 4] =
    [(2.7, 30_000_000), (2.4, 24_000_000), (2.1, 22_000_000), (1.7, 20_000_000)];

/// Ports GPIOA to GPIOI.
pub(crate) const PORTS: usize = 9;

/// An STM32F4 without its core, on its board.
#[derive(Clone)]
pub struct Stm32f4 {
    pub(crate) variant: Variant,
    pub(crate) board: Board,
    pub(crate) plant: Plant,
    pub(crate) rcc: Rcc,
    pub(crate) pwr: Pwr,
    pub(crate) flash: Flash,
    pub(crate) ports: [Gpio; PORTS],
    /// Levels that a test drives.
    pub(crate) outside: [Outside; PORTS],
    /// The level of the encoder's index at the last check.
    pub(crate) index_level: bool,
    /// The last look at the edges of the LSI for TIM5.
    pub(crate) lsi_looked: Time,
    pub(crate) syscfg: Syscfg,
    pub(crate) exti: Exti,
    pub(crate) dbgmcu: Dbgmcu,
    pub(crate) timers: [Timer; TIMERS.len()],
    pub(crate) adc: Adc,
    pub(crate) adc_common: AdcCommon,
    pub(crate) dmas: [Dma; 2],
    pub(crate) spis: [Spi; SPIS.len()],
    pub(crate) can: DualCan,
    pub(crate) iwdg: Iwdg,
    pub(crate) crc: CrcUnit,
    pub(crate) backup_ram: BackupRam,
    pub(crate) clocks: Clocks,
    pub(crate) effects: VecDeque<Effect>,
    pub(crate) record: Record,
    pub(crate) rules: Rules,
    pub(crate) losses: Losses,
    /// The cause of a reset that the chip itself has requested.
    pub(crate) asked: Option<Cause>,
    pub(crate) lines: IrqLines,
    /// Whether deadline and lines were computed again since the core's last query.
    pub(crate) has_settled: bool,
    pub(crate) deadline: Time,
}

impl Stm32f4 {
    /// A chip on a board, at power-on.
    pub fn new(variant: Variant, board: Board) -> Self {
        let clocks = Clocks::RESET;
        let mut chip = Self {
            variant,
            plant: Plant::new(&board),
            rcc: Rcc::new(variant, board.hse),
            pwr: Pwr::new(variant),
            flash: Flash::new(variant, board.write_protected),
            ports: std::array::from_fn(Gpio::new),
            outside: [Outside::default(); PORTS],
            index_level: false,
            lsi_looked: Time::ZERO,
            syscfg: Syscfg::new(),
            exti: Exti::default(),
            dbgmcu: Dbgmcu::new(variant),
            timers: TIMERS.each_ref().map(|place| Timer::new(place.kind, clocks.timer_cycle(place.bus))),
            adc: Adc::new(times(clocks.pclk2_cycle(), AdcCommon::default().divider())),
            adc_common: AdcCommon::default(),
            dmas: Default::default(),
            spis: SPIS.each_ref().map(|place| Spi::new(clocks.apb_cycle(place.bus), Ssi::new(board.ssi))),
            can: DualCan::new(clocks.pclk1()),
            iwdg: Iwdg::new(board.lsi),
            crc: CrcUnit::new(),
            backup_ram: BackupRam::default(),
            clocks,
            effects: VecDeque::new(),
            record: Record::default(),
            rules: Rules::default(),
            losses: Losses::default(),
            asked: None,
            lines: IrqLines::default(),
            has_settled: true,
            deadline: Time::NEVER,
            board,
        };
        chip.announce_clock();
        chip
    }

    /// Accesses so far that silicon would have answered differently, or not at all; one entry for each kind.
    pub fn unmodelled(&self) -> Vec<Unmodelled> {
        self.record.list()
    }

    /// Number of aborts of CAN1 that a test still makes come too late.
    pub fn late_aborts(&self) -> usize {
        self.can.can1.transmitter.late_aborts
    }

    /// Makes the chip lose the next `times` events of a kind.
    pub fn lose(&mut self, loss: Loss, times: usize) {
        match loss {
            Loss::TransmitComplete => self.can.can1.transmitter.lost_ends += times,
            Loss::LeaveBus => self.can.can1.hold(),
            Loss::LoopBack => self.can.can1.lose_loops(times),
            Loss::Abort => self.can.can1.transmitter.late_aborts += times,
            _ => self.losses.add(loss, times),
        }
    }

    /// The format of the absolute encoder's word.
    pub fn ssi(&self) -> SsiFormat {
        self.board.ssi
    }

    /// Connects an absolute encoder with another format at `now`.
    pub fn set_ssi(&mut self, format: SsiFormat, now: Time) {
        self.catch_up(now);
        self.board.ssi = format;
        self.spis.iter_mut().for_each(|spi| spi.set_format(format));
    }

    /// Sets the frequency of the LSI in hertz. The watchdog has it from the next reset on.
    pub fn set_lsi(&mut self, hertz: u32) {
        self.board.lsi = hertz;
    }

    /// Sets the time from switching HSE on to its first stable cycle.
    pub fn set_hse_start(&mut self, time: Time) {
        self.rcc.set_hse_start(time);
    }

    /// The clock tree that the program has set.
    pub fn clocks(&self) -> Clocks {
        self.clocks
    }

    /// The level that the program drives on a pin (port `'A'` to `'I'`, pin 0 to 15); `None` when the pin is no output.
    pub fn output(&self, port: char, pin: u32) -> Option<bool> {
        let index = (port as usize).checked_sub('A' as usize)?;
        self.ports.get(index)?.output(pin)
    }

    /// The physical world that the sensors measure.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// The physical world, for a change at `now`. All measurements before `now` are completed first.
    pub fn plant_mut(&mut self, now: Time) -> &mut Plant {
        self.catch_up(now);
        // The change may affect the deadline: recompute it at once.
        self.deadline = now;
        &mut self.plant
    }

    /// CAN1.
    pub fn can1(&self) -> &BxCan {
        &self.can.can1
    }

    /// CAN1 as a participant of a bus.
    pub fn can1_mut(&mut self) -> &mut BxCan {
        &mut self.can.can1
    }

    /// CAN2.
    pub fn can2(&self) -> &BxCan {
        &self.can.can2
    }

    /// CAN2 as a participant of a bus.
    pub fn can2_mut(&mut self) -> &mut BxCan {
        &mut self.can.can2
    }

    /// The content of the backup SRAM that the battery keeps without the main supply; `None` when nothing is kept.
    pub fn kept_by_battery(&self, now: Time) -> Option<Vec<u8>> {
        self.backup_is_kept(now).then(|| self.backup_ram.bytes())
    }

    /// Contents of the backup SRAM that a battery has kept, from its start.
    pub fn set_kept_by_battery(&mut self, bytes: &[u8]) {
        self.backup_ram.set_bytes(bytes);
        self.pwr.keep_backup(true);
    }

    /// Whether the supply at `now` lets the chip run. Below the level of its reset the chip stops, and starts again 0.1 V
    /// above it.
    pub fn is_supplied(&self, now: Time, is_running: bool) -> bool {
        let hysteresis = if is_running { 0.0 } else { 0.1 };
        self.plant.supply(now) >= self.flash.reset_level() + hysteresis
    }

    /// Whether the core reads the flash too fast for its wait states and the supply (RM0390 table 5).
    pub fn reads_flash_too_fast(&self, now: Time) -> bool {
        let volts = self.plant.supply(now);
        let level = PER_WAIT_STATE.into_iter().find(|(least, _)| volts >= *least);
        let (_, hertz) = level.unwrap_or(PER_WAIT_STATE[PER_WAIT_STATE.len() - 1]);
        self.clocks.hclk > hertz * u64::from(self.flash.wait_states() + 1)
    }

    pub(crate) fn backup_is_kept(&self, now: Time) -> bool {
        self.pwr.keeps_backup() && self.plant.has_battery(now)
    }

    /// The flash controller, to read its state or to cut the power in one of its operations.
    pub fn flash_mut(&mut self) -> &mut Flash {
        &mut self.flash
    }
}
