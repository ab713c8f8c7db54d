//! The cycle counter and the debug registers that programs look at (ARMv7-M ARM, C1.6 and C1.8).

/// DEMCR.TRCENA: powers the DWT.
const TRCENA: u32 = 1 << 24;
const CYCCNTENA: u32 = 1;
/// DWT_CTRL: four comparators, as the STM32F4 has.
const NUMCOMP: u32 = 4 << 28;

/// DWT_CTRL, DWT_CYCCNT and DEMCR. The counter stands while the core sleeps.
#[derive(Default)]
pub(crate) struct Dwt {
    demcr: u32,
    control: u32,
    /// Value of CYCCNT when it last started or stopped, and the core's cycles then.
    count: u32,
    anchor: u64,
}

impl Dwt {
    fn counts(&self) -> bool {
        self.demcr & TRCENA != 0 && self.control & CYCCNTENA != 0
    }

    fn settle(&mut self, cycles: u64) {
        if self.counts() {
            self.count = self.count.wrapping_add((cycles - self.anchor) as u32);
        }
        self.anchor = cycles;
    }

    pub(crate) fn demcr(&self) -> u32 {
        self.demcr
    }

    pub(crate) fn set_demcr(&mut self, value: u32, cycles: u64) {
        self.settle(cycles);
        self.demcr = value;
    }

    pub(crate) fn read(&mut self, offset: u32, cycles: u64) -> Option<u32> {
        self.settle(cycles);
        match offset {
            0x0 => Some(NUMCOMP | self.control),
            0x4 => Some(self.count),
            // CPICNT..FOLDCNT, PCSR and the lock registers read as zero.
            0x8..=0x1C | 0xFB0 | 0xFB4 => Some(0),
            _ => None,
        }
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32, cycles: u64) -> Option<()> {
        self.settle(cycles);
        match offset {
            0x0 => self.control = value & CYCCNTENA,
            0x4 => self.count = value,
            0xFB0 => {}
            _ => return None,
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_only_when_enabled() {
        let mut dwt = Dwt::default();
        dwt.write(0, CYCCNTENA, 100);
        assert_eq!(dwt.read(4, 200), Some(0));
        dwt.set_demcr(TRCENA, 200);
        assert_eq!(dwt.read(4, 350), Some(150));
        dwt.write(4, 0, 400);
        assert_eq!(dwt.read(4, 401), Some(1));
    }
}
