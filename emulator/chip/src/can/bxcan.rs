//! One bxCAN: registers, operating modes, clock.

use canbus::{ErrorState, Frame, Monitor, Time, frame_bits};

use super::fifo::Fifo;
use super::filter::FilterBanks;
use super::mailbox::Registers;
use super::status::Status;
use super::transmit::Transmitter;
use crate::register::{bit, field, flag};

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
/// Where the filter registers begin.
pub(super) const FILTERS: u32 = 0x200;

/// Bits of CAN_MCR.
const INRQ: u32 = 0;
const SLEEP: u32 = 1;
const TXFP: u32 = 2;
const RFLM: u32 = 3;
const NART: u32 = 4;
const AWUM: u32 = 5;
const ABOM: u32 = 6;
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

/// The mode that CAN_MSR acknowledges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    Sleep,
    Initialisation,
    Normal,
}

/// A frame that goes round inside in loop-back mode.
#[derive(Clone, Copy, Debug)]
struct Loop {
    frame: Frame,
    end: Time,
}

/// A bxCAN peripheral at register level.
///
/// On the bus it is a [`canbus::Controller`]. Not modelled: time stamps (TTCM is a mere flag), debug freeze, the
/// level of the CAN_RX pin within a frame, and the CAN_TX pin in loop-back mode.
#[derive(Clone, Debug)]
pub struct BxCan {
    slave: bool,
    clock: u64,
    control: u32,
    timing: u32,
    mode: Mode,
    monitor: Monitor,
    looped: Option<Loop>,
    pub(super) transmitter: Transmitter,
    pub(super) fifos: [Fifo; 2],
    pub(super) filters: FilterBanks,
    pub(super) status: Status,
    reception: Reception,
    poke: bool,
}

/// Frames that have passed a filter, since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reception {
    /// All of them.
    pub accepted: u64,
    /// Those that a full FIFO lost.
    pub lost: u64,
}

impl BxCan {
    /// CAN1, which owns the filter banks, or with `slave` CAN2. `apb1` is its clock in hertz.
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
            poke: false,
        }
    }

    /// A system reset, or one by RCC. The bus goes on as it is.
    pub(super) fn reset(&mut self) {
        let mut monitor = self.monitor;
        monitor.cancel();
        let reception = self.reception;
        *self = BxCan { monitor, reception, poke: true, ..BxCan::new(self.slave, self.clock) };
    }

    /// What the receive FIFOs were given.
    pub fn reception(&self) -> Reception {
        self.reception
    }

    /// The clock of APB1 is now this, in hertz; 0 stops it.
    pub fn set_clock(&mut self, apb1: u64) {
        self.clock = apb1;
        self.poke = true;
    }

    /// Takes the wish for `Effect::Poke`: something has changed that the bus must see before the core runs on.
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

    /// A write of the word at `offset`; `None` when no register is there.
    pub fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        self.advance(now);
        match offset {
            MCR => self.write_control(value, now),
            MSR => self.status.clear_flags(value),
            TSR => self.transmitter.write_status(value),
            RF0R => self.fifos[0].write_status(value),
            RF1R => self.fifos[1].write_status(value),
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

    /// The next instant at which something happens that neither software nor the bus causes.
    pub fn deadline(&self) -> Time {
        let looped = self.looped.map_or(Time::NEVER, |looped| looped.end);
        self.monitor.due(self.bit()).min(looped)
    }

    /// Lets everything due up to `now` happen.
    pub fn advance(&mut self, now: Time) {
        let due = self.monitor.due(self.bit());
        if self.monitor.poll(now, self.bit()) {
            self.synchronised(due);
        }
        while let Some(looped) = self.looped.take_if(|looped| looped.end <= now) {
            self.end_loop(&looped);
        }
    }

    /// The interrupt lines now.
    pub fn lines(&self) -> Lines {
        let enable = self.status.enable;
        Lines {
            tx: bit(enable, 0) && self.transmitter.interrupt(),
            rx0: self.fifos[0].interrupt(field(enable, 1, 3)),
            rx1: self.fifos[1].interrupt(field(enable, 4, 3)),
            sce: self.status.interrupt(),
        }
    }

    /// Length of a bit: one quantum of SYNC_SEG, then BS1 and BS2 (RM0390, bxCAN bit timing).
    pub(super) fn bit(&self) -> Time {
        let quanta = 3 + field(self.timing, 16, 4) + field(self.timing, 20, 3);
        let cycles = u64::from(quanta * (field(self.timing, 0, 10) + 1));
        let clock = self.clock.max(1);
        Time((Time::PER_SECOND * cycles + clock / 2) / clock)
    }

    pub(super) fn is_set(&self, bit_of_mcr: u32) -> bool {
        bit(self.control, bit_of_mcr)
    }

    /// Whether the transmitter gives up after one attempt.
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

    /// Whether it takes part in the traffic of the bus.
    pub(super) fn is_on_bus(&self) -> bool {
        self.mode == Mode::Normal && !self.loops_back() && self.clock > 0 && !self.status.is_bus_off()
    }

    /// Since when it has been on the bus, or when it will be if the wire stays as it is.
    pub(super) fn joins_at(&self) -> Option<Time> {
        let on_way = self.monitor.is_waiting() && !self.loops_back() && self.clock > 0;
        // The wait to leave initialisation while bus-off is followed by another one.
        let last = self.mode == Mode::Normal || !self.status.is_bus_off();
        (self.is_on_bus() || on_way && last).then(|| self.monitor.ready(self.bit()))
    }

    /// INAK, SLAK, TXM, RXM and the recessive input.
    fn mode_status(&self) -> u32 {
        let transmitting = self.transmitter.is_transmitting();
        let receiving = self.is_on_bus() && self.monitor.is_busy() && !transmitting;
        flag(self.mode == Mode::Initialisation, 0)
            | flag(self.mode == Mode::Sleep, 1)
            | flag(transmitting, 8)
            | flag(receiving, 9)
            | 0b11 << 10
    }

    fn write_control(&mut self, value: u32, now: Time) {
        self.poke = true;
        if bit(value, RESET) {
            return self.master_reset();
        }
        self.control = value & MCR_WRITABLE;
        self.follow_requests(now);
    }

    /// MCR.RESET: sleep mode, with the mailboxes empty. Bit timing, interrupt enables and filters stay.
    fn master_reset(&mut self) {
        let enable = self.status.enable;
        self.status = Status::default();
        self.status.write_enable(enable);
        self.control = MCR_RESET;
        self.mode = Mode::Sleep;
        self.monitor.cancel();
        self.looped = None;
        self.transmitter = Transmitter::default();
        self.fifos = Default::default();
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

    /// Moves towards the mode that INRQ and SLEEP ask for (RM0390, bxCAN operating modes).
    pub(super) fn follow_requests(&mut self, now: Time) {
        match (self.is_set(INRQ), self.is_set(SLEEP)) {
            // To leave sleep mode for initialisation, software has to clear SLEEP as well.
            (true, true) if self.mode == Mode::Sleep => {}
            (true, _) => self.stop(Mode::Initialisation),
            (false, true) => self.stop(Mode::Sleep),
            (false, false) if self.mode == Mode::Normal => self.recover(now),
            (false, false) if !self.monitor.is_waiting() => self.monitor.wait(1, now),
            (false, false) => {}
        }
    }

    /// Leaves the bus, as soon as the frame on the wire has ended.
    fn stop(&mut self, mode: Mode) {
        let in_frame = self.is_on_bus() && self.monitor.is_busy() || self.looped.is_some();
        if in_frame || self.mode == mode && !self.monitor.is_waiting() {
            return;
        }
        self.monitor.cancel();
        if self.mode == Mode::Sleep {
            self.status.awake();
        }
        if mode == Mode::Sleep && self.mode != Mode::Sleep {
            self.status.asleep();
        }
        self.mode = mode;
    }

    /// In bus-off with ABOM the recovery begins by itself.
    pub(super) fn recover(&mut self, now: Time) {
        if self.status.is_bus_off() && self.is_set(ABOM) && !self.monitor.is_waiting() {
            self.monitor.wait(Monitor::BUS_OFF_SEQUENCES, now);
        }
    }

    /// The wait for recessive bits is over: on the bus, or out of bus-off.
    fn synchronised(&mut self, now: Time) {
        if self.mode == Mode::Normal {
            return self.status.recovered();
        }
        self.mode = Mode::Normal;
        self.status.awake();
        // Software has set and cleared INRQ: that too begins the recovery.
        if self.status.is_bus_off() {
            self.monitor.wait(Monitor::BUS_OFF_SEQUENCES, now);
        }
        self.begin_loop(now);
    }

    /// In loop-back mode a frame goes round without the bus.
    fn begin_loop(&mut self, at: Time) {
        if self.mode != Mode::Normal || !self.loops_back() || self.looped.is_some() {
            return;
        }
        let order = self.by_request_order();
        if let Some(frame) = self.transmitter.scheduled(order, at) {
            self.transmitter.begin(order, at);
            self.looped = Some(Loop { frame, end: at + self.bit() * (frame_bits(&frame) - 3) });
        }
    }

    fn end_loop(&mut self, looped: &Loop) {
        self.transmitter.sent();
        self.status.sent();
        self.store(&looped.frame);
        if self.is_set(INRQ) || self.is_set(SLEEP) {
            self.follow_requests(looped.end);
        }
        self.begin_loop(looped.end + self.bit() * 3);
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

    /// A start of frame.
    pub(super) fn hear_start(&mut self, transmitting: bool, at: Time) {
        self.advance(at);
        self.monitor.busy(at, self.bit());
        if transmitting {
            self.transmitter.begin(self.by_request_order(), at);
        }
        if self.mode == Mode::Sleep && self.is_set(SLEEP) {
            self.wake(at);
        }
    }

    fn wake(&mut self, at: Time) {
        self.status.woken();
        if self.is_set(AWUM) {
            self.control &= !(1 << SLEEP);
            self.follow_requests(at);
        }
    }

    /// The wire is recessive until the next frame: a request to leave the bus can be followed now.
    pub(super) fn hear_idle(&mut self, since: Time) {
        self.monitor.idle(since);
        if self.is_set(INRQ) || self.is_set(SLEEP) {
            self.follow_requests(since);
        }
    }

    pub(super) fn is_passive(&self) -> bool {
        self.status.confinement.state() == ErrorState::Passive
    }
}
