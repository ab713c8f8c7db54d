//! SPI as a master (RM0390 section 26, RM0090 section 28): full duplex and receive only, frames of 8 and 16 bits.
//!
//! Slave mode, I2S, the hardware CRC and TI mode are not modelled: a write that selects one of these is recorded.

mod ssi;

use canbus::Time;
pub(crate) use ssi::{Reading, Ssi};
pub use ssi::{SsiFormat, SsiFormatError};

use crate::clocks::times;
use crate::register::{bit, field, flag};

const CR1: u32 = 0x00;
const CR2: u32 = 0x04;
const SR: u32 = 0x08;
const DR: u32 = 0x0C;
const CRCPR: u32 = 0x10;
const RXCRCR: u32 = 0x14;
const TXCRCR: u32 = 0x18;
const I2SCFGR: u32 = 0x1C;
const I2SPR: u32 = 0x20;

const RXNE: u32 = 0;
const TXE: u32 = 1;
const MODF: u32 = 5;
const OVR: u32 = 6;
const BSY: u32 = 7;

const CR1_MSTR: u32 = 2;
const CR1_SPE: u32 = 6;
const CR1_LSBFIRST: u32 = 7;
const CR1_SSI: u32 = 8;
const CR1_SSM: u32 = 9;
const CR1_RXONLY: u32 = 10;
const CR1_DFF: u32 = 11;
/// CRCNEXT and CRCEN.
const CR1_NOT_MODELLED: u32 = 3 << 12;
const CR1_BIDIOE: u32 = 14;
const CR1_BIDIMODE: u32 = 15;

/// A frame on the wire.
#[derive(Clone, Copy, Debug)]
struct Shift {
    start: Time,
    end: Time,
}

/// The device at the other end of the wires.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Far {
    /// The absolute encoder.
    Encoder(Reading),
    /// No device: the line has this level.
    Nothing(bool),
}

#[derive(Clone, Debug)]
pub(crate) struct Spi {
    /// One cycle of the SPI's PCLK.
    pclk: Time,
    cr1: u32,
    cr2: u32,
    received: u32,
    full: bool,
    /// DR has a frame that is not on the wire yet.
    waiting: bool,
    shift: Option<Shift>,
    overrun: bool,
    /// DR was read since the overrun: the next read of SR clears OVR.
    overrun_seen: bool,
    mode_fault: bool,
    device: Ssi,
}

impl Spi {
    /// Connects another absolute encoder.
    pub(crate) fn set_format(&mut self, format: SsiFormat) {
        self.device.set_format(format);
    }

    pub(crate) fn new(pclk: Time, device: Ssi) -> Self {
        Self {
            pclk,
            cr1: 0,
            cr2: 0,
            received: 0,
            full: false,
            waiting: false,
            shift: None,
            overrun: false,
            overrun_seen: false,
            mode_fault: false,
            device,
        }
    }

    /// A reset; the state of the device on the wire stays.
    pub(crate) fn reset(&mut self) {
        *self = Self::new(self.pclk, self.device.clone());
    }

    pub(crate) fn set_pclk(&mut self, pclk: Time) {
        self.pclk = pclk;
    }

    /// Reads a register; `run` must come first.
    pub(crate) fn read(&mut self, offset: u32) -> Option<u32> {
        match offset {
            CR1 => Some(self.cr1),
            CR2 => Some(self.cr2),
            SR => Some(self.read_status()),
            DR => Some(self.take()),
            CRCPR => Some(7),
            RXCRCR | TXCRCR | I2SCFGR => Some(0),
            I2SPR => Some(2),
            _ => None,
        }
    }

    /// Writes a register; `run` must come first. `None` when the register, or a bit set in it, is not modelled.
    pub(crate) fn write(&mut self, offset: u32, value: u32, now: Time) -> Option<()> {
        match offset {
            CR1 => self.write_control(value, now),
            CR2 => {
                self.cr2 = value & 0xF7;
                (!bit(value, 4)).then_some(())
            }
            // MODF is cleared by a read of SR and a write to CR1; the other flags are not writable.
            SR => Some(()),
            DR => {
                self.waiting = true;
                self.load(now);
                Some(())
            }
            I2SCFGR => (!bit(value, 11)).then_some(()),
            _ => None,
        }
    }

    fn write_control(&mut self, value: u32, now: Time) -> Option<()> {
        self.cr1 = value & 0xFFFF;
        let master = bit(value, CR1_MSTR);
        // A master whose NSS is low falls back to a slave: with SSM the level is SSI. NSS itself is pulled up.
        self.mode_fault = master && bit(value, CR1_SSM) && !bit(value, CR1_SSI);
        if self.mode_fault {
            self.cr1 &= !(1 << CR1_MSTR | 1 << CR1_SPE);
        }
        if !self.is_on() {
            self.shift = None;
        }
        self.load(now);
        let slave = bit(value, CR1_SPE) && !master;
        (value & CR1_NOT_MODELLED == 0 && !slave).then_some(())
    }

    fn is_on(&self) -> bool {
        bit(self.cr1, CR1_SPE) && bit(self.cr1, CR1_MSTR)
    }

    /// Whether the SPI is a master that only receives: its clock runs without end while the SPI is on.
    fn only_receives(&self) -> bool {
        bit(self.cr1, CR1_RXONLY) || bit(self.cr1, CR1_BIDIMODE) && !bit(self.cr1, CR1_BIDIOE)
    }

    fn bits(&self) -> u32 {
        if bit(self.cr1, CR1_DFF) { 16 } else { 8 }
    }

    /// Whether the clock is high at rest and bits are sampled at the second edge (CPHA and CPOL), as SSI needs.
    pub(crate) fn fits_ssi(&self) -> bool {
        field(self.cr1, 0, 2) == 0b11
    }

    /// A cycle of the serial clock, while the SPI is on.
    pub(crate) fn clock(&self) -> Option<Time> {
        self.is_on().then(|| self.bit_time())
    }

    /// The length of a bit: PCLK divided by 2 to 256.
    fn bit_time(&self) -> Time {
        times(self.pclk, 2 << field(self.cr1, 3, 3))
    }

    /// Puts the next frame on the wire when a frame is waiting and the wire is free.
    fn load(&mut self, now: Time) {
        if self.shift.is_none() && self.is_on() && (self.waiting || self.only_receives()) {
            self.waiting = false;
            let end = now + times(self.bit_time(), self.bits());
            self.shift = Some(Shift { start: now, end });
        }
    }

    /// Ends the frames that are due. `encoder` returns the device on the wires at an instant.
    pub(crate) fn run(&mut self, now: Time, encoder: impl Fn(Time) -> Far) {
        while let Some(shift) = self.shift.take_if(|shift| shift.end <= now) {
            let word = match encoder(shift.start) {
                Far::Encoder(reading) => {
                    self.device.clock_out(self.bits(), shift.start, self.bit_time(), reading)
                }
                Far::Nothing(level) => u32::from(level) * ((1 << self.bits()) - 1),
            };
            self.receive(word);
            self.load(shift.end);
        }
    }

    fn receive(&mut self, word: u32) {
        if self.full {
            // The frame is lost, because the last one was not read.
            self.overrun = true;
            self.overrun_seen = false;
            return;
        }
        let reversed = bit(self.cr1, CR1_LSBFIRST);
        self.received = if reversed { word.reverse_bits() >> (32 - self.bits()) } else { word };
        self.full = true;
    }

    fn take(&mut self) -> u32 {
        self.full = false;
        self.overrun_seen = self.overrun;
        self.received
    }

    /// Discards the received byte, as a disturbance inside the chip would.
    pub(crate) fn lose(&mut self) {
        self.full = false;
    }

    fn read_status(&mut self) -> u32 {
        let status = self.status();
        // A read of DR followed by a read of SR clears OVR (RM0390 section 26.3.10).
        if std::mem::take(&mut self.overrun_seen) {
            self.overrun = false;
        }
        status
    }

    fn status(&self) -> u32 {
        flag(self.full, RXNE)
            | flag(!self.waiting, TXE)
            | flag(self.mode_fault, MODF)
            | flag(self.overrun, OVR)
            | flag(self.shift.is_some(), BSY)
    }

    /// Whether a received frame waits for DMA.
    pub(crate) fn asks_to_store(&self) -> bool {
        bit(self.cr2, 0) && self.full
    }

    /// Whether the SPI requests the next frame from DMA.
    pub(crate) fn asks_to_load(&self) -> bool {
        bit(self.cr2, 1) && !self.waiting && self.is_on()
    }

    /// The next event that an interrupt or DMA waits for.
    pub(crate) fn deadline(&self) -> Time {
        let by_dma = self.cr2 & 3 != 0;
        let by_interrupt = self.cr2 & 0xE0 != 0 && !self.interrupt();
        self.shift.filter(|_| by_dma || by_interrupt).map_or(Time::NEVER, |shift| shift.end)
    }

    /// The level of the interrupt line.
    pub(crate) fn interrupt(&self) -> bool {
        let status = self.status();
        bit(self.cr2, 7) && bit(status, TXE)
            || bit(self.cr2, 6) && bit(status, RXNE)
            || bit(self.cr2, 5) && (self.overrun || self.mode_fault)
    }
}
