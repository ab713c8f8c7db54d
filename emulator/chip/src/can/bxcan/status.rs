//! Error and status change: CAN_ESR, CAN_IER and the flags of CAN_MSR that software clears (RM0390, bxCAN
//! error management and interrupts).

use canbus::{BusError, Confinement, ErrorReport, ErrorState};

use crate::register::{bit, field, flag};

/// Bits of CAN_MSR.
const ERRI: u32 = 2;
const WKUI: u32 = 3;
const SLAKI: u32 = 4;
/// Bits of CAN_IER.
const EWGIE: u32 = 8;
const EPVIE: u32 = 9;
const BOFIE: u32 = 10;
const LECIE: u32 = 11;
const ERRIE: u32 = 15;
const WKUIE: u32 = 16;
const SLKIE: u32 = 17;
const IER_WRITABLE: u32 = 0x0003_8F7F;

#[derive(Clone, Debug, Default)]
pub(crate) struct Status {
    pub(crate) confinement: Confinement,
    /// CAN_IER.
    pub(crate) enable: u32,
    last_error: u32,
    error: bool,
    wake_up: bool,
    sleep: bool,
}

impl Status {
    pub(crate) fn is_bus_off(&self) -> bool {
        self.confinement.state() == ErrorState::BusOff
    }

    pub(crate) fn write_enable(&mut self, value: u32) {
        self.enable = value & IER_WRITABLE;
    }

    /// CAN_ESR.
    pub(crate) fn errors(&self) -> u32 {
        self.conditions()
            | self.last_error << 4
            | u32::from(self.confinement.tec() & 0xFF) << 16
            | u32::from(self.confinement.rec()) << 24
    }

    /// EWGF, EPVF and BOFF.
    fn conditions(&self) -> u32 {
        let state = self.confinement.state();
        flag(self.confinement.warns(), 0)
            | flag(state != ErrorState::Active, 1)
            | flag(state == ErrorState::BusOff, 2)
    }

    /// Writes CAN_ESR: only LEC is writable.
    pub(crate) fn write_errors(&mut self, value: u32) {
        self.last_error = field(value, 4, 3);
    }

    /// A frame was sent.
    pub(crate) fn sent(&mut self) {
        self.confinement.sent();
        self.last_error = 0;
    }

    /// A frame was received.
    pub(crate) fn received(&mut self) {
        self.confinement.received();
        self.last_error = 0;
    }

    /// An error was signalled: counts it, and sets ERRI for every condition that is new and enabled.
    pub(crate) fn failed(&mut self, report: &ErrorReport) {
        let before = self.conditions();
        self.confinement.error(report);
        self.last_error = code(report.error);
        let new = self.conditions() & !before;
        let enabled = flag(bit(self.enable, EWGIE), 0)
            | flag(bit(self.enable, EPVIE), 1)
            | flag(bit(self.enable, BOFIE), 2);
        self.error |= new & enabled != 0 || bit(self.enable, LECIE);
    }

    /// The bus-off state ends.
    pub(crate) fn recovered(&mut self) {
        self.confinement = Confinement::default();
    }

    /// A start of frame was seen while asleep.
    pub(crate) fn woken(&mut self) {
        self.wake_up = true;
    }

    /// Sleep mode was entered; the flag is set only while its interrupt is enabled.
    pub(crate) fn asleep(&mut self) {
        self.sleep = bit(self.enable, SLKIE);
    }

    /// Sleep mode was left.
    pub(crate) fn awake(&mut self) {
        self.sleep = false;
    }

    /// ERRI, WKUI and SLAKI in CAN_MSR.
    pub(crate) fn flags(&self) -> u32 {
        flag(self.error, ERRI) | flag(self.wake_up, WKUI) | flag(self.sleep, SLAKI)
    }

    /// Clears the flags that are written as 1.
    pub(crate) fn clear_flags(&mut self, value: u32) {
        self.error &= !bit(value, ERRI);
        self.wake_up &= !bit(value, WKUI);
        self.sleep &= !bit(value, SLAKI);
    }

    /// Level of the SCE line.
    pub(crate) fn interrupt(&self) -> bool {
        self.error && bit(self.enable, ERRIE)
            || self.wake_up && bit(self.enable, WKUIE)
            || self.sleep && bit(self.enable, SLKIE)
    }
}

/// CAN_ESR.LEC.
fn code(error: BusError) -> u32 {
    match error {
        BusError::Stuff => 1,
        BusError::Form => 2,
        BusError::Ack => 3,
        BusError::BitRecessive => 4,
        BusError::BitDominant => 5,
        BusError::Crc => 6,
    }
}
