//! The registers that the three ADCs share.

use crate::register::{bit, field};

const CSR: u32 = 0x00;
const CCR: u32 = 0x04;

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct AdcCommon {
    ccr: u32,
}

impl AdcCommon {
    /// `status` holds the flags of ADC1.
    pub(crate) fn read(&self, offset: u32, status: u32) -> Option<u32> {
        match offset {
            CSR => Some(status),
            CCR => Some(self.ccr),
            _ => None,
        }
    }

    /// `None` for unmodelled settings: the multi modes and VBAT.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            CSR => Some(()),
            CCR => {
                self.ccr = value & 0x00C3_EF1F;
                (value & 0x0040_EF1F == 0).then_some(())
            }
            _ => None,
        }
    }

    /// The divider from PCLK2 to the ADC clock.
    pub(crate) fn divider(&self) -> u32 {
        2 * (field(self.ccr, 16, 2) + 1)
    }

    /// Whether the temperature sensor and the reference are on (TSVREFE).
    pub(crate) fn sensors_on(&self) -> bool {
        bit(self.ccr, 23)
    }
}
