//! One bxCAN: its registers, clock and interrupt lines.

mod fifo;
mod filter;
mod loop_back;
mod mailbox;
mod modes;
mod status;
mod transmit;

use canbus::{BitTiming, ErrorState, Frame, Monitor, Time};

use self::fifo::Fifo;
use self::filter::FilterBanks;
use self::loop_back::Loop;
use self::mailbox::Registers;
use self::modes::Mode;
use self::status::Status;
use self::transmit::Transmitter;
use crate::register::{bit, field};

const MCR: u32 = 0x00;
const MSR: u32 = 0x04;
const TSR: u32 = 0x08;
const RF0R: u32 = 0x0C;
const RF1R: u32 = 0x10;
const IER: u32 = 0x14;
const ESR: u32 = 0x18;
const BTR: u32 = 0x1C;
const TI0R: u32 = 0x180;
const TDH2R: u32 = 0x1AC;
const RI0R: u32 = 0x1B0;
const RDH1R: u32 = 0x1CC;
/// Offset of the filter registers.
pub(super) const FILTERS: u32 = 0x200;

/// Bits of CAN_MCR.
const INRQ: u32 = 0;
const SLEEP: u32 = 1;
const TXFP: u32 = 2;
const RFLM: u32 = 3;
const NART: u32 = 4;
const AWUM: u32 = 5;
const ABOM: u32 = 6;
const TTCM: u32 = 7;
const RESET: u32 = 15;
const MCR_RESET: u32 = 0x0001_0002;
const MCR_WRITABLE: u32 = 0x0001_00FF;

/// Bits of CAN_BTR.
const LBKM: u32 = 30;
const SILM: u32 = 31;
const BTR_RESET: u32 = 0x0123_0000;
const BTR_WRITABLE: u32 = 0xC37F_03FF;

/// Levels of the four interrupt lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// Transmit mailbox empty.
    pub tx: bool,
    /// FIFO 0.
    pub rx0: bool,
    /// FIFO 1.
    pub rx1: bool,
    /// Error and status change.
    pub sce: bool,
}

/// A bxCAN peripheral at register level.
///
/// On the bus the peripheral is a [`canbus::Controller`]. Not modelled: time stamps (setting TTCM is recorded), debug
/// freeze, the level of the CAN_RX pin within a frame, and the CAN_TX pin in loop-back mode.
#[derive(Clone, Debug)]
pub struct BxCan {
    slave: bool,
    clock: u64,
    control: u32,
    timing: u32,
    mode: Mode,
    monitor: Monitor,
    looped: Option<Loop>,
    pub(crate) transmitter: Transmitter,
    pub(super) fifos: [Fifo; 2],
    pub(super) filters: FilterBanks,
    pub(super) status: Status,
    reception: Reception,
    /// Cycles of the peripheral's clock between RFOM and the next frame in the output mailbox.
    release: u32,
    /// The controller acknowledges no other mode until a reset.
    is_held: bool,
    /// Frames in loop-back that a test makes the controller lose, also after resets.
    lost_loops: usize,
    poke: bool,
}

/// The default number of these cycles. The manual only says that the release takes a while.
const RELEASE: u32 = 8;

/// Frames that have passed a filter, since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// All frames that have passed a filter.
    pub accepted: u64,
    /// Frames lost because the FIFO was full.
    pub lost: u64,
}

impl BxCan {
    /// CAN1, which owns the filter banks, or with `slave` CAN2. `apb1` is the clock of APB1 in hertz.
    pub fn new(slave: bool, apb1: u64) -> BxCan {
        BxCan {
            slave,
            clock: apb1,
            control: MCR_RESET,
            timing: BTR_RESET,
            mode: Mode::Sleep,
            monitor: Monitor::new(),
            looped: None,
            transmitter: Transmitter::default(),
            fifos: Default::default(),
            filters: FilterBanks::new(),
            status: Status::default(),
            reception: Reception::default(),
            release: RELEASE,
            is_held: false,
            lost_loops: 0,
            poke: false,
        }
    }

    /// A system reset, or a reset by RCC. The state of the bus does not change.
    pub(super) fn reset(&mut self) {
        let mut monitor = self.monitor;
        monitor.cancel();
        let (reception, release, lost_loops) = (self.reception, self.release, self.lost_loops);
        let fresh = BxCan::new(self.slave, self.clock);
        *self = BxCan { monitor, reception, release, lost_loops, poke: true, ..fresh };
    }

    /// Holds the controller in its mode until a reset.
    pub(crate) fn hold(&mut self) {
        self.is_held = true;
    }

    /// Loses the next frames in loop-back.
    pub(crate) fn lose_loops(&mut self, times: usize) {
        self.lost_loops += times;
    }

    /// CAN_BTR.
    pub(crate) fn timing(&self) -> u32 {
        self.timing
    }

    /// Counts of the frames that the filters passed to the receive FIFOs.
    pub fn reception(&self) -> Reception {
        self.reception
    }

    /// Sets the clock of APB1 in hertz; 0 stops the controller.
    pub fn set_clock(&mut self, apb1: u64) {
        self.clock = apb1;
        self.poke = true;
    }

    /// Takes the request for `Effect::Poke`: a change that the bus must see before the core continues.
    pub fn take_poke(&mut self) -> bool {
        std::mem::take(&mut self.poke)
    }

    /// A read of the word at `offset`; `None` when no register is there.
    pub fn read(&mut self, offset: u32, now: Time) -> Option<u32> {
        self.advance(now);
        match offset {
            MCR => Some(self.control),
            MSR => Some(self.mode_status() | self.status.flags()),
            TSR => Some(self.transmitter.status(self.is_set(TXFP))),
            RF0R => Some(self.fifos[0].status()),
            RF1R => Some(self.fifos[1].status()),
            IER => Some(self.status.enable),
            ESR => Some(self.status.errors()),
            BTR => Some(self.timing),
            TI0R..=TDH2R => self.transmitter.read(offset - TI0R),
            RI0R..=RDH1R => self.fifos[(offset - RI0R) as usize / 16].output().read((offset - RI0R) % 16),
            FILTERS.. if !self.slave => self.filters.read(offset),
            _ => None,
        }
    }

    /// A write of the word at `offset`; `None` when no register is there, or when a setting is not modelled.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        self.advance(now);
        match offset {
            MCR => {
                self.write_control(value, now);
                return (!bit(value, TTCM)).then_some(());
            }
            MSR => self.status.clear_flags(value),
            TSR => self.transmitter.write_status(value),
            RF0R => self.fifos[0].write_status(value, now + self.release_time()),
            RF1R => self.fifos[1].write_status(value, now + self.release_time()),
            IER => self.status.write_enable(value),
            ESR => self.status.write_errors(value),
            BTR => self.write_timing(value),
            TI0R..=TDH2R => self.write_mailbox(offset - TI0R, value, now)?,
            // The receive mailboxes are write protected.
            RI0R..=RDH1R => {}
            FILTERS.. if !self.slave => self.filters.write(offset, value)?,
            _ => return None,
        }
        Some(())
    }

    /// The next instant at which the state changes without an access by software or an event on the bus.
    pub fn deadline(&self) -> Time {
        let looped = self.looped.map_or(Time::NEVER, |looped| looped.end);
        let released = self.fifos[0].deadline().min(self.fifos[1].deadline());
        self.monitor.due(self.bit()).min(looped).min(released)
    }

    /// Processes everything that is due up to `now`.
    pub fn advance(&mut self, now: Time) {
        let due = self.monitor.due(self.bit());
        if self.monitor.poll(now, self.bit()) {
            self.synchronised(due);
        }
        while let Some(looped) = self.looped.take_if(|looped| looped.end <= now) {
            self.end_loop(&looped);
        }
        self.fifos.iter_mut().for_each(|fifo| fifo.advance(now));
    }

    /// Sets the cycles from RFOM to the release of the output mailbox. Software that does not wait for the release
    /// reads a frame twice.
    pub fn release_after(&mut self, cycles: u32) {
        self.release = cycles;
    }

    fn release_time(&self) -> Time {
        Time(Time::PER_SECOND * u64::from(self.release) / self.clock.max(1))
    }

    /// The current levels of the interrupt lines.
    pub fn lines(&self) -> Lines {
        let enable = self.status.enable;
        Lines {
            tx: bit(enable, 0) && self.transmitter.interrupt(),
            rx0: self.fifos[0].interrupt(field(enable, 1, 3)),
            rx1: self.fifos[1].interrupt(field(enable, 4, 3)),
            sce: self.status.interrupt(),
        }
    }

    /// The length of a bit: one quantum of SYNC_SEG, then BS1 and BS2 (RM0390, bxCAN bit timing).
    pub(super) fn bit(&self) -> Time {
        let quanta = 3 + field(self.timing, 16, 4) + field(self.timing, 20, 3);
        let cycles = u64::from(quanta * (field(self.timing, 0, 10) + 1));
        let clock = self.clock.max(1);
        Time((Time::PER_SECOND * cycles + clock / 2) / clock)
    }

    /// The bit timing with sample point and resynchronisation jump width.
    pub(super) fn bit_timing(&self) -> BitTiming {
        let part = |from, width| field(self.timing, from, width) as u8 + 1;
        BitTiming::new(self.bit(), part(16, 4), part(20, 3), part(24, 2))
    }

    pub(super) fn is_set(&self, bit_of_mcr: u32) -> bool {
        bit(self.control, bit_of_mcr)
    }

    /// Whether the transmitter makes only one attempt for a frame.
    pub(super) fn gives_up(&self) -> bool {
        self.is_set(NART)
    }

    pub(super) fn by_request_order(&self) -> bool {
        self.is_set(TXFP)
    }

    pub(super) fn is_silent(&self) -> bool {
        bit(self.timing, SILM)
    }

    fn loops_back(&self) -> bool {
        bit(self.timing, LBKM)
    }

    /// BTR is write protected outside of initialisation mode.
    fn write_timing(&mut self, value: u32) {
        if self.mode == Mode::Initialisation {
            self.timing = value & BTR_WRITABLE;
            self.poke = true;
        }
    }

    fn write_mailbox(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        self.transmitter.write(offset, value, now)?;
        self.poke |= offset.is_multiple_of(16);
        self.begin_loop(now);
        Some(())
    }

    /// Passes a frame through the filters into its FIFO.
    pub(super) fn store(&mut self, frame: &Frame) {
        self.status.received();
        if let Some(found) = self.filters.accept(frame, self.filters.share(self.slave)) {
            let kept = self.fifos[found.fifo].store(Registers::of(frame, found.index), self.is_set(RFLM));
            self.reception.accepted += 1;
            self.reception.lost += u64::from(!kept);
        }
    }

    pub(super) fn is_passive(&self) -> bool {
        self.status.confinement.state() == ErrorState::Passive
    }
}
