//! The absolute encoder: SPI2 clocks its word in and DMA1 moves the bytes, so a word costs no time of the core but that to
//! start it and to fetch it a millisecond later.
//!
//! The clock rests high, and its first edge latches the position. The encoder puts the next bit out at each rising edge,
//! and the SPI takes one at the same edges, that is the bit of the clock before: a bit has a whole period for its way
//! through the cable. The first one is the rest level.
//!
//! # What a save costs
//!
//! Nothing. The flash stops the core for 16 us with each word that it programs, longer than a byte lasts on the line; but no
//! byte waits for the core. Both directions are moved by DMA1 between SPI2 and RAM, and neither way leads through the flash: the
//! controller's port for peripherals is at the bridge of APB1, its port for memory has SRAM to itself while the core waits
//! (RM0390, 2.1 and 9.3).
//!
//! # What a lost byte costs
//!
//! One reading. A word that is not whole a millisecond after its start will not come: it is counted ([`Event::SsiWord`]), both
//! streams and the SPI are set up anew, and the next word is started in the same millisecond. A byte that is left over does
//! the same, for it would be taken for the first one of the next word.

use core::sync::atomic::{AtomicU8, Ordering};

use stm32f4xx_hal::ClearFlags;
use stm32f4xx_hal::dma::traits::{Stream, StreamISR};
use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection, Stream3, Stream4};
use stm32f4xx_hal::gpio::{Alternate, PB13, PB14};
use stm32f4xx_hal::pac::{DMA1, SPI2};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use super::stream;
use crate::bit_timing::APB1_HZ;
use crate::losses::{Event, Losses};
use crate::ssi_word::{LONGEST, SsiWord, bytes, pack};

/// BR: APB1 divided by 64. Half of it would be more than the 1 MHz that encoders stand at most.
const DIVIDER: u8 = 5;
const CLOCK_HZ: u32 = APB1_HZ >> (DIVIDER + 1);
/// Microseconds for which the clock must rest before the next word, at most, of the encoders on the market.
const MONOFLOP: u32 = 100;

const _: () = {
    assert!(CLOCK_HZ <= 1_000_000, "encoders stand 1 MHz");
    assert!(LONGEST * 1_000_000 / CLOCK_HZ + MONOFLOP < 1000, "a word and its rest fit into a millisecond");
};

/// What DMA1 writes and the core reads. Atomic, because two bus masters share it.
static RECEIVED: [AtomicU8; LONGEST as usize / 8] = [const { AtomicU8::new(0) }; LONGEST as usize / 8];
/// What is sent for each byte, to no pin.
static SENT: AtomicU8 = AtomicU8::new(0);

/// The input.
pub struct Ssi {
    spi: SPI2,
    receive: Stream3<DMA1>,
    send: Stream4<DMA1>,
    /// Bytes of the word that was started; 0 without one.
    started: usize,
    losses: &'static Losses,
    _pins: (PB13<Alternate<5>>, PB14<Alternate<5>>),
}

/// The peripherals and pins of the input.
pub(crate) struct Parts {
    pub(crate) spi: SPI2,
    pub(crate) receive: Stream3<DMA1>,
    pub(crate) send: Stream4<DMA1>,
    pub(crate) clock: PB13,
    pub(crate) data: PB14,
}

impl Ssi {
    pub(crate) fn new(parts: Parts, losses: &'static Losses, rcc: &mut Rcc) -> Ssi {
        let Parts { spi, receive, send, clock, data } = parts;
        SPI2::enable(rcc);
        SPI2::reset(rcc);
        let pins = (clock.into_alternate(), data.into_alternate());
        let mut ssi = Ssi { spi, receive, send, started: 0, losses, _pins: pins };
        ssi.set_up();
        ssi
    }

    /// To be called once a millisecond: gives the word of the last one, and starts to clock in the next, of `length` bits, 62 at
    /// most; `None` starts nothing. There is no word where none was started, or not all of it came.
    pub fn read(&mut self, length: Option<u32>) -> Option<SsiWord> {
        let started = core::mem::take(&mut self.started);
        let word = (started > 0 && self.is_whole()).then(|| received(started));
        if started > 0 && word.is_none() {
            self.losses.count(Event::SsiWord);
            self.set_up();
        }
        if let Some(length) = length {
            self.start(length);
        }
        word
    }

    /// The stream has stored all bytes, and the SPI has none to spare and clocks no more.
    fn is_whole(&self) -> bool {
        let status = self.spi.sr().read();
        let is_at_rest =
            status.bsy().bit_is_clear() && status.rxne().bit_is_clear() && status.ovr().bit_is_clear();
        self.receive.is_transfer_complete() && is_at_rest
    }

    /// A word that is still on the line keeps the next one from starting: the encoder would take the clocks for its own.
    fn start(&mut self, length: u32) {
        if self.spi.sr().read().bsy().bit_is_set() {
            return;
        }
        self.started = bytes(length);
        self.receive.clear_all_flags();
        self.send.clear_all_flags();
        self.receive.set_number_of_transfers(self.started as u16);
        self.send.set_number_of_transfers(self.started as u16);
        // SAFETY: RECEIVED has as many bytes as the longest word, and SENT is read again and again.
        unsafe {
            self.receive.enable();
            self.send.enable();
        }
    }

    /// Everything as it is to be between two words, whatever it was before.
    fn set_up(&mut self) {
        stream::stop(&mut self.send);
        stream::stop(&mut self.receive);
        prepare_spi(&self.spi);
        prepare(&mut self.receive, &self.spi, DmaDirection::PeripheralToMemory, &RECEIVED);
        prepare(&mut self.send, &self.spi, DmaDirection::MemoryToPeripheral, core::slice::from_ref(&SENT));
    }
}

fn received(count: usize) -> SsiWord {
    pack(RECEIVED.iter().take(count).map(|byte| byte.load(Ordering::Relaxed)))
}

/// SPI2 as a master with a clock that rests high, bytes with their highest bit first (RM0390, 26.3.5). What has come and was not
/// fetched is dropped: to read DR and then SR clears RXNE and OVR (26.3.10).
fn prepare_spi(spi: &SPI2) {
    let _ = spi.dr().read();
    let _ = spi.sr().read();
    spi.cr2().write(|w| w.rxdmaen().set_bit().txdmaen().set_bit());
    spi.cr1().write(|w| {
        w.mstr().set_bit().ssm().set_bit().ssi().set_bit();
        w.br().set(DIVIDER).cpol().set_bit().cpha().set_bit().spe().set_bit()
    });
}

/// A stream between SPI2 and memory; both are on channel 0 (RM0390, table 28).
fn prepare(stream: &mut impl Stream, spi: &SPI2, direction: DmaDirection, memory: &'static [AtomicU8]) {
    stream.set_channel(DmaChannel::Channel0);
    stream.set_direction(direction);
    stream.set_peripheral_address(spi.dr().as_ptr() as u32);
    stream.set_memory_address(memory.as_ptr() as u32);
    stream.set_memory_increment(memory.len() > 1);
    // SAFETY: bytes on both sides; the SPI has frames of 8 bits.
    unsafe {
        stream.set_peripheral_size(DmaDataSize::Byte);
        stream.set_memory_size(DmaDataSize::Byte);
    }
}
