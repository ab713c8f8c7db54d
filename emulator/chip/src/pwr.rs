//! PWR: voltage scaling, over-drive and the access to the backup domain (RM0390 section 5.4, RM0090 section 5.4).
//! The regulators are ready at once; stop and standby modes are not entered. The voltage detector has its flag and no interrupt.

use crate::register::{Plain, RegisterFile, bit, field, flag};
use crate::variant::Variant;

const CR: u32 = 0x00;
const CSR: u32 = 0x04;
/// CR: writes to the backup domain are enabled.
const DBP: u32 = 8;
/// CR: the voltage detector is on; its level, in a field of three bits.
const PVDE: u32 = 4;
const PLS: u32 = 5;
/// CSR: the supply is below the level of the voltage detector.
const PVDO: u32 = 2;
/// The levels of the voltage detector in volts (RM0390 section 5.4.1, PLS).
const LEVELS: [f64; 8] = [2.0, 2.1, 2.3, 2.5, 2.6, 2.7, 2.8, 2.9];
/// CSR: the backup regulator is on. The bit is in the backup domain itself: no reset clears it.
const BRE: u32 = 9;

const F446: &[Plain] = &[Plain::new(CR, 0xC000, 0x003F_EFF3), Plain::new(CSR, 0, 0x0000_0380)];
const F405: &[Plain] = &[Plain::new(CR, 0x4000, 0x0000_43F3), Plain::new(CSR, 0, 0x0000_0300)];

#[derive(Clone)]
pub(crate) struct Pwr {
    plain: RegisterFile,
    over_drive: bool,
}

impl Pwr {
    pub(crate) fn new(variant: Variant) -> Self {
        let over_drive = variant == Variant::F446;
        Self { plain: RegisterFile::new(if over_drive { F446 } else { F405 }), over_drive }
    }

    /// A reset, which does not affect the backup regulator.
    pub(crate) fn reset(&mut self) {
        let keeps = self.keeps_backup();
        self.plain.reset();
        self.keep_backup(keeps);
    }

    /// The voltage scale of the core, 1 to 3 (RM0390 and RM0090 section 5.4.1, VOS).
    pub(crate) fn scale(&self) -> u32 {
        let control = self.plain.get(CR);
        match control >> 14 & 0b11 {
            0b11 => 1,
            0b10 => 2,
            0b01 if self.over_drive => 3,
            // The F405 has only one VOS bit.
            0b01 => 1,
            _ if self.over_drive => 3,
            _ => 2,
        }
    }

    /// Whether the core is switched to over-drive: ODEN and ODSWEN.
    pub(crate) fn over_drives(&self) -> bool {
        self.over_drive && self.plain.get(CR) >> 16 & 0b11 == 0b11
    }

    /// Whether ODSWEN is set without ODEN.
    pub(crate) fn is_switched_alone(&self) -> bool {
        self.over_drive && self.plain.get(CR) >> 16 & 0b11 == 0b10
    }

    /// Whether the backup SRAM can be written.
    pub(crate) fn backup_is_writable(&self) -> bool {
        bit(self.plain.get(CR), DBP)
    }

    /// Whether VBAT supplies the backup SRAM when the main supply fails.
    pub(crate) fn keeps_backup(&self) -> bool {
        bit(self.plain.get(CSR), BRE)
    }

    pub(crate) fn keep_backup(&mut self, keeps: bool) {
        self.plain.write(CSR, flag(keeps, BRE));
    }

    pub(crate) fn read(&self, offset: u32, volts: f64) -> Option<u32> {
        let value = self.plain.read(offset)?;
        Some(if offset == CSR { value | self.ready_bits() | flag(self.is_low(volts), PVDO) } else { value })
    }

    fn is_low(&self, volts: f64) -> bool {
        let control = self.plain.get(CR);
        bit(control, PVDE) && volts < LEVELS[field(control, PLS, 3) as usize]
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        self.plain.write(offset, value)
    }

    /// BRR, VOSRDY, ODRDY and ODSWRDY.
    fn ready_bits(&self) -> u32 {
        let control = self.plain.get(CR);
        let on = |n| self.over_drive && bit(control, n);
        flag(self.keeps_backup(), 3) | flag(true, 14) | flag(on(16), 16) | flag(self.over_drives(), 17)
    }
}
