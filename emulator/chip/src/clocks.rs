//! The lengths of the clock cycles in the clock tree.

use canbus::Time;

/// The clocks that the peripherals see. All lengths are whole multiples of the HCLK cycle, so peripherals and core
/// never drift apart by rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Clocks {
    /// Core and AHB clock in hertz.
    pub hclk: u64,
    /// The divider from HCLK to PCLK1: 1, 2, 4, 8 or 16.
    pub apb1_divider: u32,
    /// The divider from HCLK to PCLK2: 1, 2, 4, 8 or 16.
    pub apb2_divider: u32,
    /// `TIMPRE`: the limit of the timer clock is four times PCLK instead of two.
    pub fast_timers: bool,
}

/// The two peripheral buses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Apb {
    One,
    Two,
}

impl Clocks {
    /// The clocks after a reset: the 16 MHz HSI, nothing divided.
    pub const RESET: Clocks =
        Clocks { hclk: 16_000_000, apb1_divider: 1, apb2_divider: 1, fast_timers: false };

    /// One cycle of HCLK.
    pub const fn hclk_cycle(&self) -> Time {
        Time::of_cycle(self.hclk)
    }

    /// One cycle of PCLK1.
    pub fn pclk1_cycle(&self) -> Time {
        times(self.hclk_cycle(), self.apb1_divider)
    }

    /// One cycle of PCLK2.
    pub fn pclk2_cycle(&self) -> Time {
        times(self.hclk_cycle(), self.apb2_divider)
    }

    /// PCLK1 in hertz.
    pub fn pclk1(&self) -> u64 {
        self.hclk / u64::from(self.apb1_divider)
    }

    /// One cycle of the clock of a bus.
    pub(crate) fn apb_cycle(&self, bus: Apb) -> Time {
        times(self.hclk_cycle(), self.divider(bus))
    }

    /// The divider from HCLK to the clock of a bus.
    pub(crate) fn divider(&self, bus: Apb) -> u32 {
        match bus {
            Apb::One => self.apb1_divider,
            Apb::Two => self.apb2_divider,
        }
    }

    /// One cycle of the clock of the timers on a bus (RM0390 section 6.2, RCC_DCKCFGR.TIMPRE).
    pub(crate) fn timer_cycle(&self, bus: Apb) -> Time {
        let gain = if self.fast_timers { 4 } else { 2 };
        times(self.hclk_cycle(), (self.divider(bus) / gain).max(1))
    }
}

/// A span `n` times as long.
pub(crate) fn times(span: Time, n: u32) -> Time {
    Time(span.0 * u64::from(n))
}
