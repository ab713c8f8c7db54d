//! The sampling front end: TIM3 starts a scan of ADC1 16,000 times a second, DMA2 collects the results, and an
//! interrupt comes once a millisecond. Hardware alone decides when each conversion begins; the core can only collect
//! the results late.
#![expect(unsafe_code, reason = "the buffer that DMA writes, and registers")]

use core::sync::atomic::AtomicU32;

use stm32f4xx_hal::gpio::{Analog, PA0, PA1, PC2};
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, DMA2, TIM3};
use stm32f4xx_hal::rcc::{Enable, Rcc, Reset};

pub(crate) use crate::analog::oversampling::SCANS;
use crate::analog::oversampling::{self, CHANNELS, WORDS, sums};
use crate::boards::BOARD;
use crate::losses::{Event, Losses};

/// One scan: pressure, its supply, thermistor, temperature sensor, VREFINT.
const SCAN: [Conversion; CHANNELS] = [
    Conversion { channel: 0, time: EXTERNAL },
    Conversion { channel: 1, time: EXTERNAL },
    Conversion { channel: 12, time: EXTERNAL },
    Conversion { channel: BOARD.chip.temperature_channel, time: INTERNAL },
    Conversion { channel: 17, time: INTERNAL },
];
/// Conversions in a half of the buffer.
const HALF: usize = SCANS * CHANNELS;
/// Counts of TIM3 between two scans: 72 MHz / 16 kHz.
const PERIOD: u16 = 4500;

/// A channel and its sampling time.
#[derive(Clone, Copy)]
struct Conversion {
    channel: u8,
    time: SamplingTime,
}

/// An SMPx code and its number of cycles.
#[derive(Clone, Copy)]
struct SamplingTime {
    code: u8,
    cycles: u32,
}

/// 28 cycles are enough for a source of up to 15 kohm; 480 cycles give the internal sensors the necessary 10 us (STM32F446
/// datasheet, 6.3.22 to 6.3.24).
const EXTERNAL: SamplingTime = SamplingTime { code: 2, cycles: 28 };
const INTERNAL: SamplingTime = SamplingTime { code: 7, cycles: 480 };
/// The highest source resistance for `EXTERNAL` in ohms.
const HIGHEST_SOURCE: u32 = 15_000;
/// Cycles of the successive approximation, 12 bits.
const APPROXIMATION: u32 = 12;

const _: () = {
    let (mut scan, mut i) = (0, 0);
    while i < CHANNELS {
        scan += SCAN[i].time.cycles + APPROXIMATION;
        i += 1;
    }
    // The ADC runs at a quarter of APB2, which is the clock of TIM3: both 72 MHz.
    assert!(scan * 4 < PERIOD as u32, "a scan must end before the next begins");
    assert!(BOARD.front_end.source_resistance() <= HIGHEST_SOURCE, "an input settles while it is sampled");
    assert!(SCANS as u32 * PERIOD as u32 == 72_000, "the interrupt must come once a millisecond");
};

/// Number of polls for a stream to stop: the stream ends its present transfer, some ten clocks.
const STOP_POLLS: u32 = 1_000;

/// Written by the DMA controller and read by the core, two conversions in a word. Atomic, because two bus masters share
/// the memory.
static BUFFER: [AtomicU32; 2 * WORDS] = [const { AtomicU32::new(0) }; 2 * WORDS];

/// The conversions, for the self-test.
pub(crate) const CONVERSIONS: *const u32 = (&raw const BUFFER).cast::<u32>();

/// Sums over the scans of one millisecond.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sums {
    /// Per channel: pressure, its supply, thermistor, temperature sensor, VREFINT.
    pub channels: [u32; CHANNELS],
    /// The half of the buffers that the sums come from.
    pub(crate) half: usize,
    /// The millisecond before was dropped.
    pub(crate) is_second: bool,
}

impl Sums {
    /// Conversions in each sum.
    pub const COUNT: u16 = SCANS as u16;
}

/// The ADC, the timer that starts its scans, and the DMA controller that collects them.
pub(crate) struct Sampling {
    adc: ADC1,
    dma: DMA2,
    timer: TIM3,
    losses: &'static Losses,
    _pins: (PA0<Analog>, PA1<Analog>, PC2<Analog>),
}

/// The peripherals and pins of the analogue inputs.
pub(crate) struct Parts {
    pub(crate) adc: ADC1,
    pub(crate) common: ADC_COMMON,
    pub(crate) dma: DMA2,
    pub(crate) timer: TIM3,
    pub(crate) pressure: PA0<Analog>,
    pub(crate) supply: PA1<Analog>,
    pub(crate) thermistor: PC2<Analog>,
}

impl Sampling {
    /// Configures everything from the end of the data flow to its start, so that a trigger finds all parts ready.
    pub(crate) fn new(parts: Parts, losses: &'static Losses, rcc: &mut Rcc) -> Sampling {
        let Parts { adc, common, dma, timer, pressure, supply, thermistor } = parts;
        DMA2::enable(rcc);
        DMA2::reset(rcc);
        ADC1::enable(rcc);
        ADC1::reset(rcc);
        prepare_dma(&dma, &adc);
        common.ccr().write(|w| w.adcpre().div4().tsvrefe().set_bit());
        prepare_adc(&adc);
        prepare_timer(&timer, rcc);
        Sampling { adc, dma, timer, losses, _pins: (pressure, supply, thermistor) }
    }

    /// The timer that starts the scans, also used for the copies of the encoder's count at the same instants.
    pub(crate) fn scans(&self) -> &TIM3 {
        &self.timer
    }

    /// Starts the sampling. The first interrupt comes a millisecond later.
    pub(crate) fn start(&mut self) {
        self.timer.cr1().write(|w| w.cen().set_bit());
    }

    /// Stops everything and sets it up again, whatever the error: an overrun of the ADC, which then requests no more
    /// transfers (RM0390, 13.8.1), a stream that a bus error has switched off, a lost request. To be followed by
    /// [`Sampling::start`].
    pub(crate) fn set_up_again(&mut self) {
        self.timer.cr1().modify(|_, w| w.cen().clear_bit());
        self.timer.cnt().reset();
        self.adc.cr2().reset();
        self.adc.sr().reset();
        prepare_dma(&self.dma, &self.adc);
        prepare_adc(&self.adc);
    }

    /// The sums of the millisecond that has just ended; `None` if none has ended.
    pub(crate) fn take(&mut self) -> Option<Sums> {
        let flags = self.dma.lisr().read();
        forget_flags(&self.dma);
        let (half, is_second) = match (flags.htif0().bit(), flags.tcif0().bit()) {
            (false, false) => return None,
            (true, false) => (0, false),
            (false, true) => (1, false),
            (true, true) => (self.latest_of_two(), true),
        };
        let words = BUFFER.as_chunks().0.get(half)?;
        let mut channels = sums(words);
        let [pressure, ..] = &mut channels;
        *pressure = oversampling::pressure(words, *pressure);
        Some(Sums { channels, half, is_second })
    }

    /// Both halves are complete. The older one is being overwritten, so it is dropped.
    fn latest_of_two(&self) -> usize {
        self.losses.count(Event::Millisecond);
        usize::from(self.conversions_left() > HALF)
    }

    /// Number of conversions still to come in this round.
    pub(crate) fn conversions_left(&self) -> usize {
        self.dma.st(0).ndtr().read().ndt().bits().into()
    }

    /// Whether the timer is in the second half of the time between two scans.
    pub(crate) fn second_half(&self) -> bool {
        self.timer.cnt().read().bits() >= u32::from(PERIOD / 2)
    }
}

fn forget_flags(dma: &DMA2) {
    dma.lifcr().write(|w| w.chtif0().set_bit().ctcif0().set_bit().cteif0().set_bit());
}

/// DMA2 stream 0, channel 0: from ADC1 to the buffer in circular mode, with an interrupt at each half (RM0390, 9.3).
fn prepare_dma(dma: &DMA2, adc: &ADC1) {
    let stream = dma.st(0);
    stream.cr().reset();
    let _ = (0..STOP_POLLS).find(|_| stream.cr().read().en().bit_is_clear());
    forget_flags(dma);
    let source = adc.dr().as_ptr() as u32;
    let target = BUFFER.as_ptr() as u32;
    // SAFETY: the transfer goes from the data register into BUFFER and never beyond its end, and both exist for ever.
    unsafe {
        stream.par().write(|w| w.pa().bits(source));
        stream.m0ar().write(|w| w.m0a().bits(target));
    }
    stream.ndtr().write(|w| w.ndt().set(2 * HALF as u16));
    stream.cr().write(|w| {
        w.chsel().set(0).pl().very_high().msize().bits16().psize().bits16();
        w.minc().set_bit().circ().set_bit().htie().set_bit().tcie().set_bit()
    });
    stream.cr().modify(|_, w| w.en().set_bit());
}

/// ADC1: a scan on each trigger of TIM3, and a DMA request for each conversion without end (RM0390, 13.8.1).
fn prepare_adc(adc: &ADC1) {
    adc.cr1().write(|w| w.scan().set_bit());
    // SAFETY: any sampling time and any existing channel may be set.
    unsafe {
        adc.smpr1().write(|w| w.bits(times(10)));
        adc.smpr2().write(|w| w.bits(times(0)));
        adc.sqr3().write(|w| w.bits(sequence()));
    }
    adc.sqr1().write(|w| w.l().set(CHANNELS as u8 - 1));
    adc.cr2().write(|w| {
        w.exten().rising_edge().extsel().tim3trgo();
        w.dds().set_bit().dma().set_bit().adon().set_bit()
    });
    // t_STAB is 3 us at most, 432 cycles.
    cortex_m::asm::delay(500);
}

/// TIM3: its update event is the trigger.
fn prepare_timer(timer: &TIM3, rcc: &mut Rcc) {
    TIM3::enable(rcc);
    TIM3::reset(rcc);
    timer.arr().write(|w| w.arr().set(PERIOD - 1));
    timer.cr2().write(|w| w.mms().update());
}

/// Value of the SMPR register that begins with channel `first`: the sampling times of ten channels.
fn times(first: u8) -> u32 {
    let own = SCAN.iter().filter(|conversion| (first..first + 10).contains(&conversion.channel));
    own.fold(0, |register, Conversion { channel, time }| {
        register | u32::from(time.code) << (3 * (channel - first))
    })
}

/// Value of SQR3: the channels in the order of conversion.
fn sequence() -> u32 {
    SCAN.iter().rev().fold(0, |register, conversion| register << 5 | u32::from(conversion.channel))
}
