//! CAN1 and CAN2 with the filter banks that they share.

use canbus::Time;

use super::bxcan::{BxCan, FILTERS, Lines};

/// Bytes between the registers of CAN1 and those of CAN2.
const STRIDE: u32 = 0x400;

/// Both controllers of the chip.
#[derive(Clone, Debug)]
pub struct DualCan {
    /// The master at 4000 6400h, which owns the filter banks.
    pub can1: BxCan,
    /// The slave at 4000 6800h.
    pub can2: BxCan,
}

impl DualCan {
    /// Both controllers after a reset. `apb1` is the clock of APB1 in hertz.
    pub fn new(apb1: u64) -> DualCan {
        DualCan { can1: BxCan::new(false, apb1), can2: BxCan::new(true, apb1) }
    }

    /// A system reset.
    pub fn reset(&mut self) {
        self.reset_can1();
        self.reset_can2();
    }

    /// A reset of CAN1 and the filter banks.
    pub fn reset_can1(&mut self) {
        self.can1.reset();
        self.share_filters();
    }

    /// A reset of CAN2.
    pub fn reset_can2(&mut self) {
        self.can2.reset();
        self.share_filters();
    }

    /// Tells CAN2 its part of the filter banks, which are in CAN1.
    fn share_filters(&mut self) {
        self.can2.filters.clone_from(&self.can1.filters);
    }

    /// Sets the clock of APB1 in hertz; 0 stops both controllers.
    pub fn set_clock(&mut self, apb1: u64) {
        self.can1.set_clock(apb1);
        self.can2.set_clock(apb1);
    }

    /// A read of the word at `offset` from the base of CAN1; `None` when no register is there.
    pub fn read(&mut self, offset: u32, now: Time) -> Option<u32> {
        match offset {
            0..STRIDE => self.can1.read(offset, now),
            _ => self.can2.read(offset - STRIDE, now),
        }
    }

    /// A write of the word at `offset` from the base of CAN1; `None` when no register is there.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        if offset >= STRIDE {
            return self.can2.write(offset - STRIDE, value, now);
        }
        self.can1.write(offset, value, now)?;
        if offset >= FILTERS {
            self.share_filters();
        }
        Some(())
    }

    /// The next instant at which the state changes without an access by software or an event on the bus.
    pub fn deadline(&self) -> Time {
        self.can1.deadline().min(self.can2.deadline())
    }

    /// Processes everything that is due up to `now`.
    pub fn advance(&mut self, now: Time) {
        self.can1.advance(now);
        self.can2.advance(now);
    }

    /// The interrupt lines of CAN1 and of CAN2.
    pub fn lines(&self) -> [Lines; 2] {
        [self.can1.lines(), self.can2.lines()]
    }

    /// Takes the requests of both controllers for `Effect::Poke`.
    pub fn take_poke(&mut self) -> bool {
        let first = self.can1.take_poke();
        self.can2.take_poke() || first
    }
}
