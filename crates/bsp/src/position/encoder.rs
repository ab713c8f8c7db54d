//! The incremental encoder: TIM4 counts every edge of A and B, and DMA1 copies the count at two events of TIM3.
//!
//! | event of TIM3 | stream | copied count |
//! |---|---|---|
//! | update, which starts a scan of the ADC | 2 | at the start of each scan, in step with the buffer of the ADC |
//! | capture on channel 2, the index at PB5 | 5 | at the last index |
//!
//! Hardware alone decides at which instant the count is taken, as for the ADC, and no interrupt is needed.
//!
//! A copy is delayed by the DMA1 transfer: some ten cycles, and some more when it has to wait for a byte of the SSI, in
//! total less than half a microsecond. At 6000 rpm and 1024 lines a count lasts 2.4 us, so the count at the index is
//! right or one too far. An interrupt would be delayed by the longest task above it, some 10 us: four counts. (PB5 has
//! no channel of TIM4, whose free channels 3 and 4 are at the pins of CAN.)
#![expect(unsafe_code, reason = "registers, and the buffer that DMA writes")]

use core::sync::atomic::{AtomicU16, Ordering};

use stm32f4xx_hal::ClearFlags;
use stm32f4xx_hal::dma::config::Priority;
use stm32f4xx_hal::dma::traits::{Stream, StreamISR};
use stm32f4xx_hal::dma::{DmaChannel, DmaDataSize, DmaDirection, DmaFlag, Stream2, Stream5};
use stm32f4xx_hal::gpio::{Alternate, PB5, PB6, PB7};
use stm32f4xx_hal::pac::{DMA1, TIM3, TIM4};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

use crate::analog::sampling::SCANS;
use crate::losses::{Event, Losses};
use crate::position::stream;

/// ICxF of all three inputs: eight equal samples at a quarter of 72 MHz, so pulses of less than 444 ns are suppressed
/// as noise (RM0390, 17.4.7). 8,000 lines at 6000 rpm have 625 ns between two edges, with a margin of 29 % for errors of
/// the duty cycle and the phase. Index and phases have the same delay.
const FILTER: u8 = 0b0111;

/// Written by DMA1 and read by the core. Atomic, because two bus masters share the memory.
static COUNTS: [AtomicU16; 2 * SCANS] = [const { AtomicU16::new(0) }; 2 * SCANS];
static AT_INDEX: AtomicU16 = AtomicU16::new(0);

/// Readings of the encoder in one millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counted {
    /// Quarter periods, modulo 2^16, at the start of the last scan: 61 us before the interrupt.
    pub counter: u16,
    /// The count at the last index; `None` if there was none since the last call.
    pub index: Option<u16>,
    /// Time has passed unobserved since the reading before, or an index may have been missed.
    pub has_gap: bool,
}

/// The encoder input.
pub(crate) struct Encoder {
    timer: TIM4,
    at_scan: Stream2<DMA1>,
    at_index: Stream5<DMA1>,
    losses: &'static Losses,
    _pins: (PB5<Alternate<2>>, PB6<Alternate<2>>, PB7<Alternate<2>>),
}

/// The peripherals and pins of the encoder input.
pub(crate) struct Parts {
    pub(crate) timer: TIM4,
    pub(crate) at_scan: Stream2<DMA1>,
    pub(crate) at_index: Stream5<DMA1>,
    pub(crate) index: PB5,
    pub(crate) a: PB6,
    pub(crate) b: PB7,
}

impl Encoder {
    /// Configures everything while TIM3 (`scans`) is ready but not running yet, so the first count belongs to the first
    /// scan.
    ///
    /// The pins have no pull-up resistors, because with them they would not tolerate 5 V (STM32F446 datasheet, general
    /// operating conditions).
    pub(crate) fn new(parts: Parts, scans: &TIM3, losses: &'static Losses, rcc: &mut Rcc) -> Encoder {
        let Parts { timer, mut at_scan, mut at_index, index, a, b } = parts;
        prepare_counter(&timer, rcc);
        copy(&mut at_scan, &timer, &COUNTS);
        copy_at_index(&mut at_index, &timer);
        prepare_events(scans);
        let pins = (index.into_alternate(), a.into_alternate(), b.into_alternate());
        Encoder { timer, at_scan, at_index, losses, _pins: pins }
    }

    /// The count copied at the start of the last scan in this half of the buffers.
    pub(crate) fn at_last_scan(&self, half: usize) -> u16 {
        let count = COUNTS.as_chunks::<SCANS>().0.get(half).and_then(|half| half.last());
        count.map_or(0, |count| count.load(Ordering::Relaxed))
    }

    /// The present count.
    pub(crate) fn now(&self) -> u16 {
        self.timer.cnt().read().bits() as u16
    }

    /// Number of copies still to come in this round.
    pub(crate) fn copies_left(&self) -> usize {
        self.at_scan.number_of_transfers().into()
    }

    /// Stops the copies at the starts of scans; a pending request is dropped. Counting continues.
    pub(crate) fn stop_copies(&mut self, scans: &TIM3) {
        scans.dier().modify(|_, w| w.ude().clear_bit());
        stream::stop(&mut self.at_scan);
    }

    /// Restarts the copies with the first place of the buffer. TIM3 must be stopped.
    pub(crate) fn start_copies(&mut self, scans: &TIM3) {
        copy(&mut self.at_scan, &self.timer, &COUNTS);
        scans.dier().modify(|_, w| w.ude().set_bit());
    }

    /// The count at the last index; `None` if there was none since the last call. Also returns whether an index may
    /// have been lost.
    pub(crate) fn index(&mut self) -> (Option<u16>, bool) {
        if !self.at_index.is_enabled() {
            self.losses.count(Event::Index);
            stream::stop(&mut self.at_index);
            copy_at_index(&mut self.at_index, &self.timer);
            return (None, true);
        }
        if !self.at_index.is_transfer_complete() {
            return (None, false);
        }
        // In this order, an index that comes in between is reported twice, which does no harm.
        self.at_index.clear_flags(DmaFlag::TransferComplete);
        (Some(AT_INDEX.load(Ordering::Relaxed)), false)
    }
}

/// TIM4 in encoder mode 3: every edge of both inputs counts (RM0390, 17.3.12).
fn prepare_counter(timer: &TIM4, rcc: &mut Rcc) {
    TIM4::enable(rcc);
    TIM4::reset(rcc);
    timer.ccmr1_input().write(|w| w.cc1s().ti1().ic1f().set(FILTER).cc2s().ti2().ic2f().set(FILTER));
    timer.smcr().write(|w| w.sms().encoder_mode_3());
    timer.arr().write(|w| w.arr().set(u16::MAX));
    timer.cr1().write(|w| w.cen().set_bit());
}

/// Makes TIM3 request DMA at each update and at each rising edge on channel 2.
fn prepare_events(scans: &TIM3) {
    scans.ccmr1_input().write(|w| w.cc2s().ti2().ic2f().set(FILTER));
    scans.ccer().write(|w| w.cc2e().set_bit());
    scans.dier().write(|w| w.ude().set_bit().cc2de().set_bit());
}

/// Sets up the stream that copies the count at each index.
fn copy_at_index(stream: &mut Stream5<DMA1>, timer: &TIM4) {
    copy(stream, timer, core::slice::from_ref(&AT_INDEX));
}

/// Sets up a stream that copies the count to `target`, in circular mode. Both requests of TIM3 are on channel 5
/// (RM0390, table 28).
fn copy(stream: &mut impl Stream, timer: &TIM4, target: &'static [AtomicU16]) {
    stream.set_channel(DmaChannel::Channel5);
    stream.set_priority(Priority::VeryHigh);
    stream.set_direction(DmaDirection::PeripheralToMemory);
    stream.set_peripheral_address(timer.cnt().as_ptr() as u32);
    stream.set_memory_address(target.as_ptr() as u32);
    stream.set_number_of_transfers(target.len() as u16);
    stream.set_memory_increment(true);
    stream.set_circular_mode(true);
    // SAFETY: half-words from a register with 16 bits of content to half-words of `target`, which is static and has one
    // for each transfer in a round.
    unsafe {
        stream.set_peripheral_size(DmaDataSize::HalfWord);
        stream.set_memory_size(DmaDataSize::HalfWord);
        stream.enable();
    }
}
