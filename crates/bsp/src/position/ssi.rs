//! The absolute encoder: SPI2 clocks its word in and DMA1 moves the bytes, so the core only has to start a word and to
//! fetch it a millisecond later.
//!
//! The clock rests high, and its first edge latches the position. The encoder outputs the next bit at each rising edge,
//! and the SPI samples at the same edges, that is, the bit of the clock before. A bit therefore has a whole period for
//! its way through the cable. The first sampled bit is the rest level.
//!
//! # Effect of a save
//!
//! None. The flash stops the core for 16 us with each word that it programs, longer than a byte lasts on the line, but
//! no byte waits for the core. DMA1 moves both directions between SPI2 and RAM without using the flash: the
//! controller's peripheral port is at the bridge of APB1, and its memory port has SRAM to itself while the core waits
//! (RM0390, 2.1 and 9.3).
//!
//! # Effect of a lost byte
//!
//! One reading is lost. A word that is incomplete a millisecond after its start will never be complete: it is counted
//! ([`Event::SsiWord`]), both streams and the SPI are set up again, and the next word is started in the same
//! millisecond. A surplus byte has the same effect, because it would be taken for the first byte of the next word.
//!
//! # Effect of a late call
//!
//! When the core was stopped, a call comes late and the next one may follow at once. The word that is still on the line
//! then is left alone, and the call after that fetches it.
#![expect(unsafe_code, reason = "registers, and the buffers of DMA")]

use core::sync::atomic::{AtomicU8, Ordering};

use stm32f4xx_hal::ClearFlags;
use stm32f4xx_hal::dma::traits::{Stream, StreamISR};
use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection, Stream3, Stream4};
use stm32f4xx_hal::gpio::{Alternate, PB13, PB14, Speed};
use stm32f4xx_hal::pac::{DMA1, SPI2};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::boards::APB1_HZ;
use crate::losses::{Event, Losses};
use crate::position::ssi_word::{LONGEST, SsiWord, bytes, pack};
use crate::position::stream;

/// BR: APB1 divided by 64. Divided by 32, the clock would exceed 1 MHz, the limit of encoders.
const DIVIDER: u8 = 5;
const CLOCK_HZ: u32 = APB1_HZ >> (DIVIDER + 1);
/// Longest time in microseconds for which encoders on the market need the clock to rest before the next word.
const MONOFLOP: u32 = 100;

/// Speed of the clock pin. The SPI samples by the clock that it reads back from the pin. At low speed this clock may be
/// too late for the last bit of a byte, which then has the value of that bit in the byte before (ES0298, 2.14, and
/// ES0182, 2.12.4: corrupted last bit of data received in master mode with delayed SCK feedback; stm32f4xx-hal 564).
const CLOCK_SPEED: Speed = Speed::VeryHigh;

const _: () = {
    assert!(CLOCK_HZ <= 1_000_000, "encoders stand 1 MHz");
    assert!(LONGEST * 1_000_000 / CLOCK_HZ + MONOFLOP < 1000, "a word and its rest fit into a millisecond");
};

/// Written by DMA1 and read by the core. Atomic, because two bus masters share the memory.
static WORD: Aligned = Aligned([const { AtomicU8::new(0) }; LONGEST as usize / 8]);

/// Bytes that can be read as words.
#[repr(C, align(4))]
struct Aligned([AtomicU8; LONGEST as usize / 8]);

/// The bytes of the last word, for the self-test.
pub(crate) const RECEIVED: *const u32 = (&raw const WORD).cast::<u32>();
/// The byte sent for each received byte; the output has no pin.
static SENT: AtomicU8 = AtomicU8::new(0);

/// The SSI input.
pub struct Ssi {
    spi: SPI2,
    receive: Stream3<DMA1>,
    send: Stream4<DMA1>,
    /// Number of bytes of the started word; 0 without one.
    started: usize,
    /// The last call has left the word on the line. The next one does not: an SPI that never stops is set up again.
    is_left: bool,
    losses: &'static Losses,
    _pins: (PB13<Alternate<5>>, PB14<Alternate<5>>),
}

/// The peripherals and pins of the SSI input.
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
        let pins = (clock.into_alternate().speed(CLOCK_SPEED), data.into_alternate());
        let mut ssi = Ssi { spi, receive, send, started: 0, is_left: false, losses, _pins: pins };
        ssi.set_up();
        ssi
    }

    /// To be called once a millisecond: returns the last word, and starts to clock in the next word of `length` bits,
    /// 62 at most; `None` starts nothing. There is no word if none was started, or if the word is incomplete.
    pub fn read(&mut self, length: Option<u32>) -> Option<SsiWord> {
        self.is_left = self.started > 0 && self.is_on_line() && !self.is_left;
        if self.is_left {
            return None;
        }
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

    /// Whether the stream has stored all bytes, and the SPI has no surplus byte and has stopped clocking.
    fn is_whole(&self) -> bool {
        let status = self.spi.sr().read();
        let is_at_rest =
            status.bsy().bit_is_clear() && status.rxne().bit_is_clear() && status.ovr().bit_is_clear();
        self.receive.is_transfer_complete() && is_at_rest
    }

    /// Whether the SPI clocks.
    fn is_on_line(&self) -> bool {
        self.spi.sr().read().bsy().bit_is_set()
    }

    /// Starts a word, unless one is still on the line: the encoder would take the new clocks for that one.
    fn start(&mut self, length: u32) {
        if self.is_on_line() {
            return;
        }
        self.started = bytes(length);
        self.receive.clear_all_flags();
        self.send.clear_all_flags();
        self.receive.set_number_of_transfers(self.started as u16);
        self.send.set_number_of_transfers(self.started as u16);
        // SAFETY: WORD has as many bytes as the longest word, and SENT is read repeatedly.
        unsafe {
            self.receive.enable();
            self.send.enable();
        }
    }

    /// Restores the state between two words, whatever the state before.
    fn set_up(&mut self) {
        stream::stop(&mut self.send);
        stream::stop(&mut self.receive);
        prepare_spi(&self.spi);
        prepare(&mut self.receive, &self.spi, DmaDirection::PeripheralToMemory, &WORD.0);
        prepare(&mut self.send, &self.spi, DmaDirection::MemoryToPeripheral, core::slice::from_ref(&SENT));
    }
}

fn received(count: usize) -> SsiWord {
    pack(WORD.0.iter().take(count).map(|byte| byte.load(Ordering::Relaxed)))
}

/// SPI2 as a master with a clock that rests high, bytes with the highest bit first (RM0390, 26.3.5). Unread data is
/// dropped: reading DR and then SR clears RXNE and OVR (26.3.10).
fn prepare_spi(spi: &SPI2) {
    let _ = spi.dr().read();
    let _ = spi.sr().read();
    spi.cr2().write(|w| w.rxdmaen().set_bit().txdmaen().set_bit());
    spi.cr1().write(|w| {
        w.mstr().set_bit().ssm().set_bit().ssi().set_bit();
        w.br().set(DIVIDER).cpol().set_bit().cpha().set_bit().spe().set_bit()
    });
}

/// Sets up a stream between SPI2 and memory; both streams are on channel 0 (RM0390, table 28).
fn prepare(stream: &mut impl Stream, spi: &SPI2, direction: DmaDirection, memory: &'static [AtomicU8]) {
    stream.set_channel(DmaChannel::Channel0);
    stream.set_direction(direction);
    stream.set_peripheral_address(spi.dr().as_ptr() as u32);
    stream.set_memory_address(memory.as_ptr() as u32);
    stream.set_memory_increment(memory.len() > 1);
    // SAFETY: bytes on both sides; the SPI is set to frames of 8 bits.
    unsafe {
        stream.set_peripheral_size(DmaDataSize::Byte);
        stream.set_memory_size(DmaDataSize::Byte);
    }
}
