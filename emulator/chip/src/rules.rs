//! Rules that silicon enforces: limits of the data sheet, and pin functions that a program must select. A breach does
//! not change the behaviour of the models: it is reported, and the user of the chip decides whether the run has failed.

use std::collections::{BTreeSet, VecDeque};
use std::ops::{Range, RangeInclusive};

use canbus::Time;

use crate::adc::STABILISATION;
use crate::breach::Breach;
use crate::dma::Stream;
use crate::register::field;
use crate::stm32f4::Stm32f4;
use crate::variant::Variant;

/// The broken rules, each breach once.
#[derive(Clone, Debug, Default)]
pub(crate) struct Rules {
    known: BTreeSet<Breach>,
    fresh: VecDeque<Breach>,
    /// The conversions were checked, and no setting that affects them has changed since.
    pub(crate) conversions_checked: bool,
}

impl Rules {
    pub(crate) fn check(&mut self, holds: bool, breach: Breach) {
        if !holds && self.known.insert(breach) {
            self.fresh.push_back(breach);
        }
    }

    /// Whether a breach has not been reported yet.
    pub(crate) fn any_broken(&self) -> bool {
        !self.fresh.is_empty()
    }

    /// The next breach that has not been reported yet.
    pub(crate) fn take(&mut self) -> Option<Breach> {
        self.fresh.pop_front()
    }
}

const MEGA: u64 = 1_000_000;
/// The HCLK that one wait state allows at 2.7 to 3.6 V.
const PER_WAIT_STATE: u64 = 30 * MEGA;
/// The limits of the input and the VCO of the PLL.
const PLL_INPUT: RangeInclusive<u64> = 950_000..=2_100_000;
const PLL_VCO: RangeInclusive<u64> = 100 * MEGA..=432 * MEGA;
/// The limits of the ADC clock at 2.4 to 3.6 V.
const ADC_CLOCK: RangeInclusive<u64> = 600_000..=36 * MEGA;
/// The clock frequencies of absolute encoders with SSI, in hertz.
const SSI_CLOCK: RangeInclusive<u64> = 0..=MEGA;
/// The least sampling time of the temperature sensor and the internal reference.
const INTERNAL_SOURCE: Time = Time::from_micros(10);
/// The switch and the capacitor of the ADC's input (DS10693, ADC characteristics: typical values), and the time constants in
/// which the capacitor comes to within a quarter of a step: ln(2^14).
const SWITCH_OHMS: f64 = 6_000.0;
const SAMPLING_FARAD: f64 = 4e-12;
const SETTLING: f64 = 9.7;
/// The range of sample points in CiA 301, table 1, in permille.
const SAMPLE_POINT: RangeInclusive<u32> = 850..=900;

/// Ports.
const A: usize = 0;
const B: usize = 1;
const C: usize = 2;
/// The transceiver of the board is at PB8 and PB9, which AF9 switches to CAN1 (DS10693 table 11).
const CAN_FUNCTION: u32 = 9;
const CAN_RX: u32 = 8;
const CAN_TX: u32 = 9;
/// The clock of the absolute encoder is at PB13.
const SSI_PIN: u32 = 13;
/// The flash array (RM0390, table 4).
const FLASH: Range<u32> = 0x0800_0000..0x0810_0000;
/// The least supply for operations of the flash by words, in millivolts.
const WORD_SUPPLY: u32 = 2700;
/// HCLK cycles until new dividers of the buses are in force.
const DIVIDER_CYCLES: u64 = 16;
/// The inputs of ADC1 in use on the board, with their pins.
const ANALOGUE: [(u32, usize, char, u32); 3] = [(0, A, 'A', 0), (1, A, 'A', 1), (12, C, 'C', 2)];
/// The channel of the internal reference.
const REFERENCE: u32 = 17;

impl Stm32f4 {
    fn check_clock(&mut self, name: &'static str, hertz: u64, range: &RangeInclusive<u64>) {
        let (least, most) = (*range.start(), *range.end());
        self.rules.check(range.contains(&hertz), Breach::Clock { name, hertz, least, most });
    }

    /// Checks the rules after a change of the clock tree, the regulator or the wait states.
    pub(crate) fn check_clocks(&mut self) {
        let clocks = self.clocks;
        let (hclk, pclk1, pclk2) = self.highest_clocks();
        self.check_clock("HCLK", clocks.hclk, &(0..=hclk));
        self.check_clock("PCLK1", clocks.pclk1(), &(0..=pclk1));
        self.check_clock("PCLK2", clocks.hclk / u64::from(clocks.apb2_divider), &(0..=pclk2));
        if let Some((input, vco)) = self.rcc.pll() {
            self.check_clock("the input of the PLL", input, &PLL_INPUT);
            self.check_clock("the VCO of the PLL", vco, &PLL_VCO);
        }
        let (states, hertz) = (self.flash.wait_states(), clocks.hclk);
        let least = hertz.div_ceil(PER_WAIT_STATE).saturating_sub(1) as u32;
        self.rules.check(states >= least, Breach::WaitStates { hertz, states, least });
    }

    /// Checks the rules after a store to PWR.
    pub(crate) fn check_regulator(&mut self, before: u32) {
        let changes = self.pwr.scale() != before;
        self.rules.check(!(changes && self.rcc.pll().is_some()), Breach::VoltageScale);
        self.rules.check(!self.pwr.is_switched_alone(), Breach::OverDrive);
    }

    /// Checks the rules after a store to RCC.
    pub(crate) fn check_oscillator(&mut self) {
        self.rules.check(!self.rcc.take_late_bypass(), Breach::Bypass);
        let Some(is_bypassed) = self.rcc.hse_is_bypassed().filter(|_| self.board.hse.is_some()) else {
            return;
        };
        let name = |is_clock| if is_clock { "a clock" } else { "a crystal" };
        let (set, present) = (name(is_bypassed), name(self.board.hse_is_clock));
        self.rules.check(set == present, Breach::Oscillator { set, present });
    }

    /// Checks the supply during an operation of the flash.
    pub(crate) fn check_flash_supply(&mut self, now: Time) {
        self.rules.check(!self.flash.works_by_double_words(now), Breach::NoVpp);
        let millivolts = (self.plant.supply(now) * 1000.0) as u32;
        let holds = millivolts >= WORD_SUPPLY || !self.flash.works_by_words(now);
        self.rules.check(holds, Breach::FlashSupply { millivolts });
    }

    /// The highest HCLK, PCLK1 and PCLK2 at the current voltage scale of the core.
    fn highest_clocks(&self) -> (u64, u64, u64) {
        let over = self.pwr.over_drives();
        let hclk = match (self.variant, self.pwr.scale()) {
            (Variant::F446, 1) if over => 180,
            (Variant::F446, 2) if over => 168,
            (Variant::F446, 3) => 120,
            (_, 1) => 168,
            _ => 144,
        };
        let (pclk1, pclk2) = if over { (45, 90) } else { (42, 84) };
        (hclk * MEGA, pclk1 * MEGA, pclk2 * MEGA)
    }

    /// Checks the rules when CAN1 is about to join the bus.
    pub(crate) fn check_can(&mut self) {
        let timing = self.can.can1.timing();
        let (looped, silent) = (field(timing, 30, 1) != 0, field(timing, 31, 1) != 0);
        let pin = |pin, function| Breach::Pin { port: 'B', pin, function };
        let hears = looped || self.ports[B].alternate(CAN_RX, CAN_FUNCTION);
        self.rules.check(hears, pin(CAN_RX, "CAN1_RX"));
        let speaks = looped || silent || self.ports[B].alternate(CAN_TX, CAN_FUNCTION);
        self.rules.check(speaks, pin(CAN_TX, "CAN1_TX"));
        // The pin has a pull resistor on a board with such a transceiver: it wakes by an output only.
        let (port, pin, asleep) = self.board.standby;
        let is_awake = self.output(port, pin) == Some(!asleep);
        self.rules.check(looped || is_awake, Breach::Asleep { port, pin });
        let (before, after) = (field(timing, 16, 4) + 2, field(timing, 20, 3) + 1);
        let permille = 1000 * before / (before + after);
        self.rules.check(SAMPLE_POINT.contains(&permille), Breach::SamplePoint { permille });
    }

    /// Checks the rules after a store to a DMA controller: 0 is DMA1.
    pub(crate) fn check_streams(&mut self, number: usize) {
        let controller = number + 1;
        let dma = &mut self.dmas[number];
        let flags = dma.take(Stream::take_begun_with_flags);
        let stop = dma.take(Stream::take_set_up_early);
        let address = dma.take(Stream::take_odd_address);
        let flags = flags.map(|stream| Breach::DmaFlags { controller, stream });
        let stop = stop.map(|stream| Breach::DmaStop { controller, stream });
        let address = address.map(|stream| Breach::DmaAddress { controller, stream });
        for breach in [flags, stop, address].into_iter().flatten() {
            self.rules.check(false, breach);
        }
    }

    /// Checks the rule after a store to an SPI: the clock must not be too fast for the absolute encoder.
    pub(crate) fn check_ssi(&mut self, spi: usize) {
        if let Some(clock) = self.spis[spi].clock().filter(|_| self.ssi_is_wired(spi)) {
            self.check_clock("the SSI clock", Time::PER_SECOND / clock.0, &SSI_CLOCK);
            let (port, pin) = ('B', SSI_PIN);
            let breach = Breach::PinSpeed { port, pin, function: "SPI2_SCK" };
            self.rules.check(!self.ports[B].is_slowest(pin), breach);
        }
    }

    /// Checks the rule before the core sleeps: `address` is that of WFI.
    pub(crate) fn check_sleep(&mut self, address: u32) {
        let is_risky = FLASH.contains(&address) && !address.is_multiple_of(8);
        self.rules.check(!(is_risky && self.dbgmcu.debugs_sleep()), Breach::Sleep { address });
    }

    /// Checks the rule after a store to CFGR.
    pub(crate) fn check_dividers(&mut self) {
        if let Some(cycles) = self.rcc.take_switch() {
            self.rules.check(cycles >= DIVIDER_CYCLES, Breach::Divider { cycles });
        }
    }

    /// Checks the rules before a conversion, once for each setting.
    pub(crate) fn check_conversions(&mut self) {
        if std::mem::replace(&mut self.rules.conversions_checked, true) {
            return;
        }
        let clock = self.clocks.hclk / u64::from(self.clocks.apb2_divider * self.adc_common.divider());
        self.check_clock("ADCCLK", clock, &ADC_CLOCK);
        for (channel, sampled) in self.adc.sampling() {
            if let Some(least) = self.least_sampling_time(channel) {
                let (nanoseconds, needed) = (nanoseconds(sampled), nanoseconds(least));
                let breach = Breach::SamplingTime { channel, nanoseconds, least: needed };
                self.rules.check(sampled >= least, breach);
            }
            for (_, index, port, pin) in ANALOGUE.into_iter().filter(|place| place.0 == channel) {
                let breach = Breach::Pin { port, pin, function: "analogue" };
                self.rules.check(self.ports[index].is_analogue(pin), breach);
            }
        }
    }

    /// The least time to sample a channel that the board uses, to half a step of 12 bits (DS10693, equation of the highest
    /// external impedance).
    fn least_sampling_time(&self, channel: u32) -> Option<Time> {
        if channel == REFERENCE || channel == self.variant.temperature_channel() {
            return Some(INTERNAL_SOURCE);
        }
        let ohms = self.board.front_end.source_resistance(channel)?;
        let seconds = (ohms + SWITCH_OHMS) * SAMPLING_FARAD * SETTLING;
        Some(Time((seconds * Time::PER_SECOND as f64) as u64))
    }

    /// Checks the rule before a conversion that begins at an instant.
    pub(crate) fn check_stability(&mut self) {
        if let Some(since) = self.adc.take_early_start() {
            let (nanoseconds, least) = (nanoseconds(since), nanoseconds(STABILISATION));
            self.rules.check(false, Breach::Stabilisation { nanoseconds, least });
        }
    }
}

fn nanoseconds(time: Time) -> u64 {
    time.0 * 1000 / Time::PER_MICRO
}
