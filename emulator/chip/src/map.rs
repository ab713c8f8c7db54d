//! The address map (RM0390 table 1, RM0090 table 1): the peripheral at each address, and the gate of its clock.

use std::sync::LazyLock;

use crate::backup_ram;
use crate::clocks::Apb;
use crate::dma::{Line, line};
use crate::rcc::Gate;
use crate::signature;
use crate::timer::Kind;
use crate::variant::Variant;

/// The model behind a block of addresses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unit {
    /// The index into `TIMERS`.
    Timer(usize),
    /// The port: 0 is GPIOA.
    Gpio(usize),
    Rcc,
    Pwr,
    Flash,
    Syscfg,
    Dbgmcu,
    Exti,
    Iwdg,
    Adc,
    AdcCommon,
    /// The controller: 0 is DMA1.
    Dma(usize),
    /// The controller: 0 is CAN1.
    Can(usize),
    /// The index into `SPIS`.
    Spi(usize),
    Crc,
    BackupRam,
    Signature,
    /// The option bytes.
    Options,
    /// The chip has the peripheral, but the emulator has no model of it.
    Absent,
}

/// The chips that have a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum On {
    All,
    F446,
    F405And407,
    F407,
}

impl On {
    fn has(self, variant: Variant) -> bool {
        match self {
            On::All => true,
            On::F446 => variant == Variant::F446,
            On::F405And407 => variant != Variant::F446,
            On::F407 => variant == Variant::F407,
        }
    }
}

/// One block of addresses.
#[derive(Debug)]
pub(crate) struct Block {
    pub(crate) base: u32,
    size: u32,
    pub(crate) name: &'static str,
    pub(crate) unit: Unit,
    /// The clock gate; `None` for a peripheral that is always clocked.
    pub(crate) gate: Option<Gate>,
    on: On,
}

const KIB: u32 = 0x400;

const fn block(base: u32, name: &'static str, unit: Unit, gate: Option<Gate>) -> Block {
    Block { base, size: KIB, name, unit, gate, on: On::All }
}

const fn absent(base: u32, name: &'static str, gate: Option<Gate>) -> Block {
    block(base, name, Unit::Absent, gate)
}

impl Unit {
    /// Whether a store at this offset affects no later event, no interrupt line and nothing outside the chip.
    pub(crate) fn is_passive(self, offset: u32) -> bool {
        match self {
            Unit::Crc | Unit::BackupRam | Unit::Signature | Unit::Options => true,
            // ODR and BSRR.
            Unit::Gpio(_) => matches!(offset, 0x14 | 0x18),
            _ => false,
        }
    }
}

impl Block {
    const fn on(self, on: On) -> Self {
        Self { on, ..self }
    }

    const fn size(self, size: u32) -> Self {
        Self { size, ..self }
    }

    /// Whether a narrow store changes only its own bytes, as on the AHB. An APB bridge repeats a byte or half-word over
    /// the whole word (RM0390 section 2.2.1).
    pub(crate) fn has_byte_lanes(&self) -> bool {
        self.base >= 0x4002_0000
    }
}

/// Every block, in the order of the addresses.
const BLOCKS: &[Block] = &[
    absent(0x1FFF_0000, "SYSTEM_MEMORY", None).size(0x7800),
    absent(0x1FFF_7800, "OTP", None).size(0x210),
    block(signature::BASE, "SIGNATURE", Unit::Signature, None).size(0x20),
    block(0x1FFF_C000, "OPTION_BYTES", Unit::Options, None).size(0x10),
    block(0x4000_0000, "TIM2", Unit::Timer(0), Gate::apb1(0)),
    block(0x4000_0400, "TIM3", Unit::Timer(1), Gate::apb1(1)),
    block(0x4000_0800, "TIM4", Unit::Timer(2), Gate::apb1(2)),
    block(0x4000_0C00, "TIM5", Unit::Timer(3), Gate::apb1(3)),
    block(0x4000_1000, "TIM6", Unit::Timer(4), Gate::apb1(4)),
    block(0x4000_1400, "TIM7", Unit::Timer(5), Gate::apb1(5)),
    block(0x4000_1800, "TIM12", Unit::Timer(9), Gate::apb1(6)),
    block(0x4000_1C00, "TIM13", Unit::Timer(10), Gate::apb1(7)),
    block(0x4000_2000, "TIM14", Unit::Timer(11), Gate::apb1(8)),
    absent(0x4000_2800, "RTC", None),
    absent(0x4000_2C00, "WWDG", Gate::apb1(11)),
    block(0x4000_3000, "IWDG", Unit::Iwdg, None),
    absent(0x4000_3400, "I2S2ext", Gate::apb1(14)).on(On::F405And407),
    block(0x4000_3800, "SPI2", Unit::Spi(1), Gate::apb1(14)),
    block(0x4000_3C00, "SPI3", Unit::Spi(2), Gate::apb1(15)),
    absent(0x4000_4000, "I2S3ext", Gate::apb1(15)).on(On::F405And407),
    absent(0x4000_4000, "SPDIFRX", Gate::apb1(16)).on(On::F446),
    absent(0x4000_4400, "USART2", Gate::apb1(17)),
    absent(0x4000_4800, "USART3", Gate::apb1(18)),
    absent(0x4000_4C00, "UART4", Gate::apb1(19)),
    absent(0x4000_5000, "UART5", Gate::apb1(20)),
    absent(0x4000_5400, "I2C1", Gate::apb1(21)),
    absent(0x4000_5800, "I2C2", Gate::apb1(22)),
    absent(0x4000_5C00, "I2C3", Gate::apb1(23)),
    absent(0x4000_6000, "FMPI2C1", Gate::apb1(24)).on(On::F446),
    block(0x4000_6400, "CAN1", Unit::Can(0), Gate::apb1(25)),
    block(0x4000_6800, "CAN2", Unit::Can(1), Gate::apb1(26)),
    absent(0x4000_6C00, "CEC", Gate::apb1(27)).on(On::F446),
    block(0x4000_7000, "PWR", Unit::Pwr, Gate::apb1(28)),
    absent(0x4000_7400, "DAC", Gate::apb1(29)),
    absent(0x4001_0000, "TIM1", Gate::apb2(0)),
    absent(0x4001_0400, "TIM8", Gate::apb2(1)),
    absent(0x4001_1000, "USART1", Gate::apb2(4)),
    absent(0x4001_1400, "USART6", Gate::apb2(5)),
    block(0x4001_2000, "ADC1", Unit::Adc, Gate::apb2(8)).size(0x100),
    absent(0x4001_2100, "ADC2", Gate::apb2(9)).size(0x100),
    absent(0x4001_2200, "ADC3", Gate::apb2(10)).size(0x100),
    block(0x4001_2300, "ADC_Common", Unit::AdcCommon, Gate::apb2(8)).size(0x100),
    absent(0x4001_2C00, "SDIO", Gate::apb2(11)),
    block(0x4001_3000, "SPI1", Unit::Spi(0), Gate::apb2(12)),
    block(0x4001_3400, "SPI4", Unit::Spi(3), Gate::apb2(13)).on(On::F446),
    block(0x4001_3800, "SYSCFG", Unit::Syscfg, Gate::apb2(14)),
    block(0x4001_3C00, "EXTI", Unit::Exti, None),
    block(0x4001_4000, "TIM9", Unit::Timer(6), Gate::apb2(16)),
    block(0x4001_4400, "TIM10", Unit::Timer(7), Gate::apb2(17)),
    block(0x4001_4800, "TIM11", Unit::Timer(8), Gate::apb2(18)),
    absent(0x4001_5800, "SAI1", Gate::apb2(22)).on(On::F446),
    absent(0x4001_5C00, "SAI2", Gate::apb2(23)).on(On::F446),
    block(0x4002_0000, "GPIOA", Unit::Gpio(0), Gate::ahb1(0)),
    block(0x4002_0400, "GPIOB", Unit::Gpio(1), Gate::ahb1(1)),
    block(0x4002_0800, "GPIOC", Unit::Gpio(2), Gate::ahb1(2)),
    block(0x4002_0C00, "GPIOD", Unit::Gpio(3), Gate::ahb1(3)),
    block(0x4002_1000, "GPIOE", Unit::Gpio(4), Gate::ahb1(4)),
    block(0x4002_1400, "GPIOF", Unit::Gpio(5), Gate::ahb1(5)),
    block(0x4002_1800, "GPIOG", Unit::Gpio(6), Gate::ahb1(6)),
    block(0x4002_1C00, "GPIOH", Unit::Gpio(7), Gate::ahb1(7)),
    block(0x4002_2000, "GPIOI", Unit::Gpio(8), Gate::ahb1(8)).on(On::F405And407),
    block(0x4002_3000, "CRC", Unit::Crc, Gate::ahb1(12)),
    block(0x4002_3800, "RCC", Unit::Rcc, None),
    block(0x4002_3C00, "FLASH", Unit::Flash, None),
    block(0x4002_4000, "BKPSRAM", Unit::BackupRam, Gate::ahb1(18)).size(backup_ram::SIZE),
    block(0x4002_6000, "DMA1", Unit::Dma(0), Gate::ahb1(21)),
    block(0x4002_6400, "DMA2", Unit::Dma(1), Gate::ahb1(22)),
    absent(0x4002_8000, "ETH", Gate::ahb1(25)).size(0x1400).on(On::F407),
    absent(0x4004_0000, "OTG_HS", Gate::ahb1(29)).size(0x4_0000),
    absent(0x5000_0000, "OTG_FS", Gate::ahb2(7)).size(0x4_0000),
    absent(0x5005_0000, "DCMI", Gate::ahb2(0)).on(On::F446),
    absent(0x5005_0000, "DCMI", Gate::ahb2(0)).on(On::F407),
    absent(0x5006_0800, "RNG", Gate::ahb2(6)).on(On::F405And407),
    absent(0xA000_0000, "FMC", Gate::ahb3(0)).size(4 * KIB),
    absent(0xA000_1000, "QUADSPI", Gate::ahb3(1)).size(4 * KIB).on(On::F446),
    block(0xE004_2000, "DBGMCU", Unit::Dbgmcu, None),
];

/// The addresses of the peripherals on APB and AHB1, and the smallest size of a block there.
const TABLE: std::ops::Range<u32> = 0x4000_0000..0x4004_0000;
const STEP: u32 = 0x100;

/// The block at each step of these addresses, for a look-up in one step.
type Table = Vec<Option<&'static Block>>;

/// The block at an address.
pub(crate) fn find(variant: Variant, address: u32) -> Option<&'static Block> {
    static TABLES: LazyLock<Vec<Table>> = LazyLock::new(|| Variant::ALL.into_iter().map(table).collect());
    if !TABLE.contains(&address) {
        return search(variant, address);
    }
    let block = TABLES[variant as usize][((address - TABLE.start) / STEP) as usize]?;
    (address - block.base < block.size).then_some(block)
}

fn table(variant: Variant) -> Table {
    TABLE.step_by(STEP as usize).map(|address| search(variant, address)).collect()
}

fn search(variant: Variant, address: u32) -> Option<&'static Block> {
    let after = BLOCKS.partition_point(|block| block.base <= address);
    // At most two blocks share a base; they belong to different chips.
    let candidates = BLOCKS[..after].iter().rev().take(2);
    candidates.filter(|block| block.on.has(variant)).find(|block| address - block.base < block.size)
}

/// All blocks of all chips.
pub(crate) fn blocks() -> impl Iterator<Item = &'static Block> {
    BLOCKS.iter()
}

/// A timer: its features, its bus and its interrupt line.
pub(crate) struct TimerPlace {
    pub(crate) kind: Kind,
    pub(crate) bus: Apb,
    pub(crate) irq: u8,
}

const fn timer(wide: bool, channels: u32, bus: Apb, irq: u8) -> TimerPlace {
    TimerPlace { kind: Kind { wide, channels, requests: 0, sees_lsi: false }, bus, irq }
}

/// The DMA requests of TIM3 that are modelled, as bits of DIER (UDE and CC2DE) and as lines to streams of DMA1 (RM0390
/// table 28).
const TIM3_REQUESTS: u32 = 1 << 8 | 1 << 10;
pub(crate) const TIM3_UPDATE: [Line; 1] = [line(2, 5)];
pub(crate) const TIM3_CHANNEL_2: [Line; 1] = [line(5, 5)];

impl TimerPlace {
    const fn requests(mut self, requests: u32) -> Self {
        self.kind.requests = requests;
        self
    }

    const fn with_lsi(mut self) -> Self {
        self.kind.sees_lsi = true;
        self
    }
}

/// TIM2 to TIM7, TIM9 to TIM14.
pub(crate) const TIMERS: [TimerPlace; 12] = [
    timer(true, 4, Apb::One, 28),
    timer(false, 4, Apb::One, 29).requests(TIM3_REQUESTS),
    timer(false, 4, Apb::One, 30),
    timer(true, 4, Apb::One, 50).with_lsi(),
    timer(false, 0, Apb::One, 54),
    timer(false, 0, Apb::One, 55),
    timer(false, 2, Apb::Two, 24),
    timer(false, 1, Apb::Two, 25),
    timer(false, 1, Apb::Two, 26),
    timer(false, 2, Apb::One, 43),
    timer(false, 1, Apb::One, 44),
    timer(false, 1, Apb::One, 45),
];

/// Interrupt lines of the streams of DMA1 and DMA2 (RM0390 table 38).
pub(crate) const DMA_IRQS: [[u8; 8]; 2] =
    [[11, 12, 13, 14, 15, 16, 17, 47], [56, 57, 58, 59, 60, 68, 69, 70]];

/// TX, RX0, RX1 and SCE of CAN1 and CAN2.
pub(crate) const CAN_IRQS: [[u8; 4]; 2] = [[19, 20, 21, 22], [63, 64, 65, 66]];

/// FLASH and ADC.
pub(crate) const FLASH_IRQ: u8 = 4;
pub(crate) const ADC_IRQ: u8 = 18;

/// An SPI: its bus, its interrupt line and the DMA requests for its two directions (RM0390 tables 28 and 29).
pub(crate) struct SpiPlace {
    pub(crate) bus: Apb,
    pub(crate) irq: u8,
    /// 0 is DMA1.
    pub(crate) dma: usize,
    pub(crate) receive: [Line; 2],
    pub(crate) transmit: [Line; 2],
}

/// SPI1 to SPI4.
pub(crate) const SPIS: [SpiPlace; 4] = [
    SpiPlace {
        bus: Apb::Two,
        irq: 35,
        dma: 1,
        receive: [line(0, 3), line(2, 3)],
        transmit: [line(3, 3), line(5, 3)],
    },
    SpiPlace {
        bus: Apb::One,
        irq: 36,
        dma: 0,
        receive: [line(3, 0), line(3, 0)],
        transmit: [line(4, 0), line(4, 0)],
    },
    SpiPlace {
        bus: Apb::One,
        irq: 51,
        dma: 0,
        receive: [line(0, 0), line(2, 0)],
        transmit: [line(5, 0), line(7, 0)],
    },
    SpiPlace {
        bus: Apb::Two,
        irq: 84,
        dma: 1,
        receive: [line(0, 4), line(3, 5)],
        transmit: [line(1, 4), line(4, 5)],
    },
];
