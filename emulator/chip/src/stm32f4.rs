//! The chip: its peripherals, wired together.

use std::collections::VecDeque;

use canbus::Time;

use crate::clocks::Clocks;
use crate::dbgmcu::Dbgmcu;
use crate::flash::Flash;
use crate::gpio::{Gpio, Outside};
use crate::map::{self, TIMERS, Unit};
use crate::peripherals::{BusFault, Effect, IrqLines, Memory, Peripherals};
use crate::pwr::Pwr;
use crate::rcc::{Cause, Rcc};
use crate::syscfg::Syscfg;
use crate::timer::Timer;
use crate::unmodelled::{Record, Unmodelled};
use crate::variant::Variant;

/// Ports GPIOA to GPIOI.
pub(crate) const PORTS: usize = 9;

/// What the board around the chip is made of.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Board {
    /// Frequency of the clock on OSC_IN in hertz; `None` without one.
    pub hse: Option<u64>,
}

impl Default for Board {
    /// A NUCLEO-F446RE: 8 MHz from the ST-LINK.
    fn default() -> Self {
        Self { hse: Some(8_000_000) }
    }
}

/// An STM32F4 without its core.
pub struct Stm32f4 {
    pub(crate) variant: Variant,
    pub(crate) rcc: Rcc,
    pub(crate) pwr: Pwr,
    pub(crate) flash: Flash,
    pub(crate) ports: [Gpio; PORTS],
    pub(crate) outside: [Outside; PORTS],
    pub(crate) syscfg: Syscfg,
    pub(crate) dbgmcu: Dbgmcu,
    pub(crate) timers: [Timer; TIMERS.len()],
    pub(crate) clocks: Clocks,
    pub(crate) effects: VecDeque<Effect>,
    pub(crate) record: Record,
    lines: IrqLines,
    deadline: Time,
}

impl Stm32f4 {
    /// A chip on a board, at power-on.
    pub fn new(variant: Variant, board: Board) -> Self {
        let mut chip = Self {
            variant,
            rcc: Rcc::new(variant, board.hse),
            pwr: Pwr::new(variant),
            flash: Flash::new(),
            ports: std::array::from_fn(Gpio::new),
            outside: [Outside::default(); PORTS],
            syscfg: Syscfg::new(),
            dbgmcu: Dbgmcu::new(variant),
            timers: timers(),
            clocks: Clocks::RESET,
            effects: VecDeque::new(),
            record: Record::default(),
            lines: IrqLines::default(),
            deadline: Time::NEVER,
        };
        chip.announce_clock();
        chip
    }

    /// Accesses so far that silicon would have answered differently, or not at all; one entry for each kind.
    pub fn unmodelled(&self) -> Vec<Unmodelled> {
        self.record.list()
    }

    /// Takes the clock on OSC_IN away (`None`) or gives one, in hertz: the HSE is then dead or alive.
    pub fn set_hse(&mut self, hertz: Option<u64>) {
        self.rcc.set_hse(hertz);
    }

    /// The clock tree as the program has set it.
    pub fn clocks(&self) -> Clocks {
        self.clocks
    }

    /// The level that the program drives on a pin (port `'A'` to `'I'`, pin 0 to 15); `None` when it drives none.
    pub fn output(&self, port: char, pin: u32) -> Option<bool> {
        let index = (port as usize).checked_sub('A' as usize)?;
        self.ports.get(index)?.output(pin)
    }

    /// Lets everything due up to `now` happen.
    pub(crate) fn pass(&mut self, now: Time) {
        if now < self.deadline {
            return;
        }
        self.rcc.advance(now);
        self.update_clocks(now);
        for index in 0..self.timers.len() {
            self.run_timer(index, now);
        }
        self.settle();
    }

    pub(crate) fn run_timer(&mut self, index: usize, now: Time) {
        self.timers[index].run(now, 0);
    }

    /// After a change: what is due next, and which lines are up.
    pub(crate) fn settle(&mut self) {
        self.deadline = self.timers.iter().map(Timer::deadline).fold(self.rcc.deadline(), Time::min);
        self.lines = IrqLines::default();
        for (timer, place) in self.timers.iter().zip(&TIMERS) {
            self.lines.0 |= u128::from(timer.interrupt()) << place.irq;
        }
    }

    /// Brings every clocked unit to a clock tree that may have changed.
    pub(crate) fn update_clocks(&mut self, now: Time) {
        let clocks = self.rcc.clocks();
        if clocks == self.clocks {
            return;
        }
        for (index, place) in TIMERS.iter().enumerate() {
            self.run_timer(index, now);
            self.timers[index].set_cycle(clocks.timer_cycle(place.bus), now);
        }
        let core_changed = clocks.hclk != self.clocks.hclk;
        self.clocks = clocks;
        if core_changed {
            self.announce_clock();
        }
    }

    fn announce_clock(&mut self) {
        self.effects.push_back(Effect::CoreClock(self.clocks.hclk));
    }

    /// Puts one peripheral into its state after reset.
    pub(crate) fn reset_unit(&mut self, unit: Unit) {
        match unit {
            Unit::Timer(index) => {
                let place = &TIMERS[index];
                self.timers[index] = Timer::new(place.kind, self.clocks.timer_cycle(place.bus));
            }
            Unit::Gpio(port) => self.ports[port] = Gpio::new(port),
            Unit::Pwr => self.pwr = Pwr::new(self.variant),
            Unit::Syscfg => self.syscfg = Syscfg::new(),
            Unit::Flash => self.flash = Flash::new(),
            Unit::Rcc | Unit::Dbgmcu | Unit::Absent => {}
        }
    }
}

fn timers() -> [Timer; TIMERS.len()] {
    TIMERS.each_ref().map(|place| Timer::new(place.kind, Clocks::RESET.timer_cycle(place.bus)))
}

impl Peripherals for Stm32f4 {
    fn read(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault> {
        self.pass(now);
        self.load(address, size, now)
    }

    fn write(&mut self, address: u32, size: u8, value: u32, now: Time) -> Result<(), BusFault> {
        self.pass(now);
        self.store(address, size, value, now)?;
        self.settle();
        Ok(())
    }

    fn program(&mut self, _address: u32, _old: &[u8], _new: &[u8], _now: Time) -> Result<(), BusFault> {
        Err(BusFault)
    }

    fn deadline(&self) -> Time {
        self.deadline
    }

    fn advance(&mut self, now: Time, _memory: &dyn Memory) {
        self.pass(now);
    }

    fn lines(&self) -> IrqLines {
        self.lines
    }

    fn effect(&mut self) -> Option<Effect> {
        self.effects.pop_front()
    }

    fn reset(&mut self, power: bool, _now: Time) {
        self.rcc.reset((!power).then_some(Cause::Software));
        self.clocks = Clocks::RESET;
        self.announce_clock();
        map::blocks().for_each(|block| self.reset_unit(block.unit));
        self.settle();
    }
}
