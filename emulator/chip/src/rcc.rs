//! RCC: oscillators, PLL, prescalers, clock gates, peripheral resets and the cause of the last reset
//! (RM0390 section 6.3, RM0090 section 7.3).

use canbus::Time;

use crate::clocks::Clocks;
use crate::register::{Plain, RegisterFile, bit, field, flag};
use crate::variant::Variant;

const CR: u32 = 0x00;
const PLLCFGR: u32 = 0x04;
const CFGR: u32 = 0x08;
const CIR: u32 = 0x0C;
const BDCR: u32 = 0x70;
const CSR: u32 = 0x74;
const DCKCFGR: u32 = 0x8C;
/// The reset registers start here; the enable registers follow 20h later and have the same bits.
const AHB1RSTR: u32 = 0x10;
const TO_ENABLE: u32 = 0x20;

const PLAIN: &[Plain] = &[
    Plain::new(PLLCFGR, 0x2400_3010, 0x7F43_7FFF),
    Plain::new(CFGR, 0, 0xFFFF_FCF3),
    Plain::new(0x10, 0, 0x2260_11FF),
    Plain::new(0x14, 0, 0x0000_00F1),
    Plain::new(0x18, 0, 0x0000_0003),
    Plain::new(0x20, 0, 0x3FFF_C9FF),
    Plain::new(0x24, 0, 0x00C7_7933),
    Plain::new(0x30, 0x0010_0000, 0x7E75_11FF),
    Plain::new(0x34, 0, 0x0000_00F1),
    Plain::new(0x38, 0, 0x0000_0003),
    Plain::new(0x40, 0, 0x3FFF_C9FF),
    Plain::new(0x44, 0, 0x00C7_7F33),
    Plain::new(0x50, 0x7E67_91FF, 0x7E67_91FF),
    Plain::new(0x54, 0x0000_00F1, 0x0000_00F1),
    Plain::new(0x58, 0x0000_0001, 0x0000_0003),
    Plain::new(0x60, 0x36FE_C9FF, 0x3FFF_C9FF),
    Plain::new(0x64, 0x0007_5F33, 0x00C7_7F33),
    Plain::new(0x84, 0x2000_3000, 0x7F03_7FFF),
    Plain::new(0x88, 0x2400_3000, 0x0F03_7FFF),
    Plain::new(DCKCFGR, 0, 0x07F0_1F1F),
];

/// The bit that gates the clock of a peripheral, in one of the enable registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Gate {
    enable: u32,
    bit: u32,
}

impl Gate {
    pub(crate) const fn ahb1(bit: u32) -> Option<Self> {
        Some(Self { enable: 0x30, bit })
    }

    pub(crate) const fn ahb2(bit: u32) -> Option<Self> {
        Some(Self { enable: 0x34, bit })
    }

    pub(crate) const fn ahb3(bit: u32) -> Option<Self> {
        Some(Self { enable: 0x38, bit })
    }

    pub(crate) const fn apb1(bit: u32) -> Option<Self> {
        Some(Self { enable: 0x40, bit })
    }

    pub(crate) const fn apb2(bit: u32) -> Option<Self> {
        Some(Self { enable: 0x44, bit })
    }
}

/// An oscillator or PLL.
#[derive(Clone, Copy)]
struct Source {
    /// The source's ON bit in RCC_CR; the RDY bit is the next higher bit.
    on_bit: u32,
    startup: Time,
    on: bool,
    /// The instant from which on the source is stable; a failed source never is.
    ready: Time,
}

impl Source {
    const fn new(on_bit: u32, startup_us: u64) -> Self {
        Self { on_bit, startup: Time::from_micros(startup_us), on: false, ready: Time::NEVER }
    }

    fn bits(&self, now: Time) -> u32 {
        flag(self.on, self.on_bit) | flag(now >= self.ready, self.on_bit + 1)
    }

    fn switch(&mut self, on: bool, ready: Time) {
        if on != self.on {
            self.on = on;
            self.ready = if on { ready } else { Time::NEVER };
        }
    }
}

/// The cause of the last reset: a bit of RCC_CSR.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Cause {
    Software = 28,
    Watchdog = 29,
}

const HSI: usize = 0;
const HSE: usize = 1;
const PLL: usize = 2;
/// BORRSTF, PINRSTF, PORRSTF.
const POWER_ON_FLAGS: u32 = 0x0E00_0000;
const RESET_FLAGS: u32 = 0xFE00_0000;
const PINRSTF: u32 = 1 << 26;
/// The clock security system: CSSON of RCC_CR, CSSF and CSSC of RCC_CIR.
const CSSON: u32 = 19;
const HSEBYP: u32 = 18;
const CSSF: u32 = 7;
const CSSC: u32 = 23;
/// CFGR: HPRE, PPRE1 and PPRE2.
const DIVIDERS: u32 = 0xFCF0;
const HSI_HERTZ: u64 = 16_000_000;

/// The reset and clock controller.
#[derive(Clone)]
pub(crate) struct Rcc {
    variant: Variant,
    /// Frequency of the clock on OSC_IN; `None` without one.
    hse_hertz: Option<u64>,
    plain: RegisterFile,
    /// HSI, HSE, PLL, PLLI2S, PLLSAI. Start-up times as in the data sheet (DS10693, electrical characteristics).
    sources: [Source; 5],
    /// HSITRIM, HSEBYP and CSSON.
    settings: u32,
    /// The clock security system has detected a failure of HSE.
    has_failed: bool,
    lsi_ready: Time,
    reset_flags: u32,
    /// The clock source in use, coded as SW.
    in_use: u32,
    /// The last change of a divider of the buses.
    divided: Option<Time>,
    /// HCLK cycles from the last change of a divider to a switch of the system clock.
    switched: Option<u64>,
    /// A store has changed HSEBYP while HSE was on.
    late_bypass: bool,
}

impl Rcc {
    pub(crate) fn new(variant: Variant, hse_hertz: Option<u64>) -> Self {
        let mut rcc = Self {
            variant,
            hse_hertz,
            plain: RegisterFile::new(PLAIN),
            sources: [
                Source::new(0, 2),
                Source::new(16, 2),
                Source::new(24, 100),
                Source::new(26, 100),
                Source::new(28, 100),
            ],
            settings: 0x80,
            has_failed: false,
            lsi_ready: Time::NEVER,
            reset_flags: POWER_ON_FLAGS,
            in_use: 0,
            divided: None,
            switched: None,
            late_bypass: false,
        };
        rcc.sources[HSI].switch(true, Time::ZERO);
        rcc
    }

    /// A power-on reset (`cause` is `None`) or a system reset; the flags of earlier causes stay until RMVF.
    pub(crate) fn reset(&mut self, cause: Option<Cause>) {
        let flags = match cause {
            None => POWER_ON_FLAGS,
            // Every internal reset also drives NRST low.
            Some(cause) => self.reset_flags | 1 << cause as u32 | PINRSTF,
        };
        let hse_start = self.sources[HSE].startup;
        *self = Self::new(self.variant, self.hse_hertz);
        self.set_hse_start(hse_start);
        self.reset_flags = flags;
    }

    /// Sets the clock on OSC_IN from now on; `None` removes it. Without a clock HSE never becomes ready. A system clock
    /// derived from HSE runs on as if from HSI, unless the clock security system is on.
    pub(crate) fn set_hse(&mut self, hertz: Option<u64>, now: Time) {
        if hertz == self.hse_hertz {
            return;
        }
        self.hse_hertz = hertz;
        let was_watched = bit(self.settings, CSSON) && self.sources[HSE].ready <= now;
        let ready = self.ready_at(HSE, now);
        self.sources[HSE].ready = if self.sources[HSE].on { ready } else { Time::NEVER };
        if hertz.is_none() && was_watched {
            self.fail();
        }
    }

    /// The action of the clock security system at a failure of HSE (RM0390, 6.2.7).
    fn fail(&mut self) {
        self.has_failed = true;
        if self.uses(HSE) {
            self.sources[HSI].switch(true, Time::ZERO);
            self.sources[PLL].switch(false, Time::NEVER);
            self.in_use = HSI as u32;
            let cfgr = self.plain.get(CFGR) & !0b11;
            let _ = self.plain.write(CFGR, cfgr);
        }
        self.sources[HSE].switch(false, Time::NEVER);
    }

    /// Whether NMI is raised: until the program clears the flag of the failure.
    pub(crate) fn clock_has_failed(&self) -> bool {
        self.has_failed
    }

    /// Whether the clock of a peripheral runs and its reset is not held.
    pub(crate) fn enabled(&self, gate: Gate) -> bool {
        bit(self.plain.get(gate.enable), gate.bit) && !self.held_in_reset(gate)
    }

    /// Whether the reset bit of a peripheral is set.
    pub(crate) fn held_in_reset(&self, gate: Gate) -> bool {
        bit(self.plain.get(gate.enable - TO_ENABLE), gate.bit)
    }

    /// Whether `offset` is one of the reset registers.
    pub(crate) const fn is_reset_register(offset: u32) -> bool {
        offset >= AHB1RSTR && offset < AHB1RSTR + TO_ENABLE
    }

    /// Turns the LSI on for the independent watchdog, without software.
    pub(crate) fn start_lsi(&mut self, now: Time) {
        if self.lsi_ready == Time::NEVER {
            // tsu(LSI) of DS10693: 15 us typical, 40 us at most.
            self.lsi_ready = now + Time::from_micros(15);
        }
    }

    /// Whether the LSI runs.
    pub(crate) fn lsi_runs(&self, now: Time) -> bool {
        now >= self.lsi_ready
    }

    /// Sets the time that HSE takes to start, also after later resets.
    pub(crate) fn set_hse_start(&mut self, time: Time) {
        self.sources[HSE].startup = time;
    }

    pub(crate) fn read(&self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            CR => Some(self.sources.iter().fold(self.settings, |word, source| word | source.bits(now))),
            CFGR => Some(self.plain.get(CFGR) | self.in_use << 2),
            CIR => Some(flag(self.has_failed, CSSF)),
            // No LSE crystal is modelled: LSE never becomes ready.
            BDCR => Some(0),
            CSR => Some(
                self.reset_flags | flag(self.lsi_ready != Time::NEVER, 0) | flag(now >= self.lsi_ready, 1),
            ),
            DCKCFGR.. if self.variant != Variant::F446 => None,
            _ => self.plain.read(offset),
        }
    }

    /// Writes a register. `None` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            CR => {
                self.write_control(value, now);
                Some(())
            }
            CFGR => self.write_configuration(value, now),
            // Ready interrupts are not modelled; clearing their flags has no effect.
            CIR => {
                self.has_failed &= !bit(value, CSSC);
                (value & 0x7F00 == 0).then_some(())
            }
            BDCR => (value & 0xFFFF == 0).then_some(()),
            CSR => {
                self.write_status(value, now);
                Some(())
            }
            PLLCFGR if self.sources[PLL].on => Some(()),
            DCKCFGR.. if self.variant != Variant::F446 => None,
            _ => self.plain.write(offset, value),
        }
    }

    /// A divider and the system clock that change together have no time between them.
    fn write_configuration(&mut self, value: u32, now: Time) -> Option<()> {
        let changed = self.plain.get(CFGR) ^ value;
        if changed & DIVIDERS != 0 {
            self.divided = Some(now);
        }
        if changed & 0b11 != 0 {
            let cycle = self.clocks().hclk_cycle().0.max(1);
            self.switched = self.divided.map(|divided| now.since(divided).0 / cycle);
        }
        self.plain.write(CFGR, value)
    }

    /// Takes the HCLK cycles from the last change of a divider to a switch of the system clock, if there was a switch.
    pub(crate) fn take_switch(&mut self) -> Option<u64> {
        self.switched.take()
    }

    /// Whether a store has changed HSEBYP while HSE was on, since the last call.
    pub(crate) fn take_late_bypass(&mut self) -> bool {
        std::mem::take(&mut self.late_bypass)
    }

    /// Whether HSE is bypassed, while it is on.
    pub(crate) fn hse_is_bypassed(&self) -> Option<bool> {
        self.sources[HSE].on.then_some(bit(self.settings, HSEBYP))
    }

    fn write_control(&mut self, value: u32, now: Time) {
        self.late_bypass |= self.sources[HSE].on && bit(self.settings ^ value, HSEBYP);
        // HSEBYP keeps its value while HSE is on (RM0390, 6.3.1).
        let kept = if self.sources[HSE].on { 1 << HSEBYP } else { 0 };
        self.settings = value & 0x000C_00F8 & !kept | self.settings & kept;
        for index in 0..self.sources.len() {
            // Software cannot stop a source in use.
            let on = bit(value, self.sources[index].on_bit) || self.uses(index);
            let ready = self.ready_at(index, now);
            self.sources[index].switch(on, ready);
        }
    }

    /// The instant at which a source becomes ready if it is switched on now.
    fn ready_at(&self, index: usize, now: Time) -> Time {
        let from_hse = bit(self.plain.get(PLLCFGR), 22);
        let dead = self.hse_hertz.is_none() && (index == HSE || index >= PLL && from_hse);
        if dead { Time::NEVER } else { now + self.sources[index].startup }
    }

    /// Whether the system clock comes from this source, directly or through the PLL.
    fn uses(&self, index: usize) -> bool {
        let pll = self.in_use >= 2;
        let root = match (pll, bit(self.plain.get(PLLCFGR), 22)) {
            (true, true) => HSE,
            (true, false) => HSI,
            (false, _) => self.in_use as usize,
        };
        index == root || pll && index == PLL
    }

    fn write_status(&mut self, value: u32, now: Time) {
        if bit(value, 0) {
            self.start_lsi(now);
        } else {
            self.lsi_ready = Time::NEVER;
        }
        if bit(value, 24) {
            self.reset_flags &= !RESET_FLAGS;
        }
    }

    /// Carries out a pending switch of the system clock when its source is ready.
    pub(crate) fn advance(&mut self, now: Time) {
        if now >= self.deadline() {
            self.in_use = self.wanted();
        }
    }

    /// The instant of a pending switch of the system clock.
    pub(crate) fn deadline(&self) -> Time {
        if self.wanted() == self.in_use {
            Time::NEVER
        } else {
            self.sources[self.wanted().min(2) as usize].ready
        }
    }

    fn wanted(&self) -> u32 {
        field(self.plain.get(CFGR), 0, 2)
    }

    /// The present clock tree.
    pub(crate) fn clocks(&self) -> Clocks {
        let cfgr = self.plain.get(CFGR);
        let timpre = self.variant == Variant::F446 && bit(self.plain.get(DCKCFGR), 24);
        Clocks {
            // A PLL with an output of 0 Hz has no edges; one hertz has the same effect.
            hclk: (self.system_clock() / u64::from(ahb_divider(field(cfgr, 4, 4)))).max(1),
            apb1_divider: apb_divider(field(cfgr, 10, 3)),
            apb2_divider: apb_divider(field(cfgr, 13, 3)),
            fast_timers: timpre,
        }
    }

    /// Input and VCO of the PLL in hertz, while it is on.
    pub(crate) fn pll(&self) -> Option<(u64, u64)> {
        let config = self.plain.get(PLLCFGR);
        let source = if bit(config, 22) { self.hse_hertz.unwrap_or(HSI_HERTZ) } else { HSI_HERTZ };
        let input = source / u64::from(field(config, 0, 6).max(1));
        self.sources[PLL].on.then_some((input, input * u64::from(field(config, 6, 9))))
    }

    fn system_clock(&self) -> u64 {
        match self.in_use {
            0 => HSI_HERTZ,
            1 => self.hse_hertz.unwrap_or(HSI_HERTZ),
            output => self.pll_output(output),
        }
    }

    /// The PLL's output P (code 2) or R (code 3, F446), RM0390 section 6.3.2.
    fn pll_output(&self, output: u32) -> u64 {
        let config = self.plain.get(PLLCFGR);
        let input = if bit(config, 22) { self.hse_hertz.unwrap_or(HSI_HERTZ) } else { HSI_HERTZ };
        let m = field(config, 0, 6).max(2);
        let divider = if output == 2 { 2 * (field(config, 16, 2) + 1) } else { field(config, 28, 3).max(2) };
        input * u64::from(field(config, 6, 9)) / u64::from(m * divider)
    }
}

fn ahb_divider(hpre: u32) -> u32 {
    match hpre {
        0..=7 => 1,
        8..=11 => 2 << (hpre - 8),
        // There is no divider of 32.
        _ => 64 << (hpre - 12),
    }
}

fn apb_divider(ppre: u32) -> u32 {
    if ppre < 4 { 1 } else { 2 << (ppre - 4) }
}
