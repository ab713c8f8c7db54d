//! The table of seeded bugs.

use emulator::{Access, Bug};
use object::{Object, ObjectSymbol};
use sim::world::World;

use crate::scenario::Node;
use crate::support::firmware;

/// A bug, and a part of the text that the board reports.
pub(super) struct Row {
    pub(super) name: &'static str,
    pub(super) node: Node,
    does: Does,
    pub(super) says: &'static str,
}

/// The bug in the program.
enum Does {
    /// A wrong access to a register.
    Access(Bug),
    /// The first instructions of an interrupt handler: halfwords of Thumb code.
    Code(&'static str, &'static [u16]),
}

impl Row {
    /// Seeds the bug before the program starts.
    pub(super) fn seed(&self, world: &mut World) {
        if let Does::Access(bug) = self.does {
            world.machine(0).seed(bug);
        }
    }

    /// Seeds the bug while the program runs.
    pub(super) fn patch(&self, world: &mut World) {
        if let Does::Code(handler, code) = self.does {
            let bytes: Vec<u8> = code.iter().flat_map(|half| half.to_le_bytes()).collect();
            world.machine(0).write(address_of(handler), &bytes).unwrap();
        }
    }
}

/// The address of a function in the application.
fn address_of(function: &str) -> u32 {
    let elf = firmware();
    let file = object::File::parse(&*elf).unwrap();
    let symbol = file.symbols().find(|symbol| symbol.name() == Ok(function)).expect(function);
    u32::try_from(symbol.address()).unwrap() & !1
}

const fn row(name: &'static str, register: u32, access: Access, says: &'static str) -> Row {
    Row { name, node: Node::Pressure, does: Does::Access(Bug { register, access }), says }
}

const fn missing(name: &'static str, register: u32, says: &'static str) -> Row {
    row(name, register, Access::Missing, says)
}

const fn wrong(name: &'static str, register: u32, bits: u32, value: u32, says: &'static str) -> Row {
    row(name, register, Access::Wrong { bits, value }, says)
}

/// The program ignores bits of a register.
const fn unseen(name: &'static str, register: u32, bits: u32, says: &'static str) -> Row {
    row(name, register, Access::Unseen { bits }, says)
}

const fn code(name: &'static str, handler: &'static str, code: &'static [u16], says: &'static str) -> Row {
    Row { name, node: Node::Pressure, does: Does::Code(handler, code), says }
}

impl Row {
    const fn with(self, node: Node) -> Row {
        Row { node, ..self }
    }
}

// RM0390, sections 3.8, 4.8, 5.4, 6.3, 7.4, 9.5, 13.13, 16.4, 17.4, 20.4, 26.7, 30.9.
const PWR_CR: u32 = 0x4000_7000;
const RCC: u32 = 0x4002_3800;
const PLLCFGR: u32 = RCC + 0x04;
const CFGR: u32 = RCC + 0x08;
const AHB1ENR: u32 = RCC + 0x30;
const APB1ENR: u32 = RCC + 0x40;
const APB2ENR: u32 = RCC + 0x44;
const FLASH_ACR: u32 = 0x4002_3C00;
const FLASH_KEYR: u32 = 0x4002_3C04;
const FLASH_CR: u32 = 0x4002_3C10;
const GPIOA: u32 = 0x4002_0000;
const GPIOB: u32 = 0x4002_0400;
const OSPEEDR: u32 = 0x08;
const BSRR: u32 = 0x18;
const AFRL: u32 = 0x20;
const AFRH: u32 = 0x24;
const CAN1: u32 = 0x4000_6400;
const DMA1: u32 = 0x4002_6000;
const DMA2: u32 = 0x4002_6400;
const ADC1: u32 = 0x4001_2000;
const ADC_CCR: u32 = 0x4001_2304;
const TIM2: u32 = 0x4000_0000;
const TIM3: u32 = 0x4000_0400;
const TIM4: u32 = 0x4000_0800;
const SPI2: u32 = 0x4000_3800;
const IWDG: u32 = 0x4000_3000;
/// Interrupts 0 to 31, 32 to 63; ARMv7-M, B3.4.
const ISER0: u32 = 0xE000_E100;
const ISER1: u32 = 0xE000_E104;
const CPACR: u32 = 0xE000_ED88;
const VTOR: u32 = 0xE000_ED08;

pub(super) const STORES: &[Row] = &[
    // Clocks and supply.
    wrong("no wait states", FLASH_ACR, 0xF, 0, "0 wait states of the flash"),
    wrong("three wait states", FLASH_ACR, 0xF, 3, "3 wait states of the flash at 144000000 Hz; it needs 4"),
    wrong("PLL multiplies by 216", PLLCFGR, 0x7FC0, 216 << 6, "HCLK at 216000000 Hz"),
    wrong("VCO of the PLL too fast", PLLCFGR, 0x7FC0, 432 << 6, "the VCO of the PLL at 864000000 Hz"),
    wrong("input of the PLL too fast", PLLCFGR, 0x3F, 2, "the input of the PLL at 4000000 Hz"),
    wrong("APB1 not divided", CFGR, 0b111 << 10, 0, "PCLK1 at 144000000 Hz"),
    wrong("APB2 not divided", CFGR, 0b111 << 13, 0, "PCLK2 at 144000000 Hz"),
    wrong("clock taken for a crystal", RCC, 1 << 18, 0, "HSE is switched on for a crystal"),
    wrong("regulator at scale 3", PWR_CR, 0b11 << 14, 0b01 << 14, "HCLK at 144000000 Hz"),
    wrong("PLL fed by HSI", PLLCFGR, 1 << 22, 0, "the input of the PLL at 4000000 Hz"),
    // Clocks of peripherals.
    wrong("GPIOB without clock", AHB1ENR, 1 << 1, 0, "GPIOB is accessed without its clock"),
    wrong("CAN1 without clock", APB1ENR, 1 << 25, 0, "CAN1 is accessed without its clock"),
    wrong("TIM2 without clock", APB1ENR, 1 << 0, 0, "TIM2 is accessed without its clock"),
    wrong("TIM3 without clock", APB1ENR, 1 << 1, 0, "TIM3 is accessed without its clock"),
    wrong("ADC1 without clock", APB2ENR, 1 << 8, 0, "ADC1 is accessed without its clock"),
    wrong("DMA2 without clock", AHB1ENR, 1 << 22, 0, "DMA2 is accessed without its clock"),
    wrong("backup SRAM without clock", AHB1ENR, 1 << 18, 0, "BKPSRAM is accessed without its clock"),
    wrong("TIM4 without clock", APB1ENR, 1 << 2, 0, "TIM4 is accessed without its clock").with(Node::Encoder),
    wrong("SPI2 without clock", APB1ENR, 1 << 14, 0, "SPI2 is accessed without its clock")
        .with(Node::Absolute),
    wrong("backup domain protected", PWR_CR, 1 << 8, 0, "written while the backup domain is protected")
        .with(Node::Encoder),
    // Pins.
    wrong("CAN on AF8", GPIOB + AFRH, 0xFF, 0x88, "PB8 is not switched to CAN1_RX"),
    wrong("CAN_TX an input", GPIOB, 0b11 << 18, 0, "PB9 is not switched to CAN1_TX"),
    wrong("pressure input not analogue", GPIOA, 0b11, 0, "PA0 is not switched to analogue"),
    wrong("encoder on AF1", GPIOB + AFRL, 0xFF << 24, 0x11 << 24, "the position is").with(Node::Encoder),
    wrong("SPI2 on AF6", GPIOB + AFRH, 0xFF << 20, 0x66 << 20, "the position is").with(Node::Absolute),
    wrong("standby pin of the transceiver an input", GPIOB, 0b11 << 24, 0, "its transceiver asleep: PB12"),
    wrong("SSI clock pin an input", GPIOB, 0b11 << 26, 0, "the position is").with(Node::Absolute),
    // CAN.
    wrong("one quantum less before the sample point", CAN1 + 0x1C, 0xF << 16, 13 << 16, "errors on the bus"),
    wrong("half the bit rate", CAN1 + 0x1C, 0x3FF, 3, "errors on the bus"),
    wrong("the last segment at its longest", CAN1 + 0x1C, 0x7F << 16, 7 << 20 | 8 << 16, "CAN samples at"),
    wrong("CAN silent", CAN1 + 0x1C, 1 << 31, 1 << 31, "0 boot-up messages instead of one"),
    wrong("CAN loops back", CAN1 + 0x1C, 1 << 30, 1 << 30, "no answer to SDO"),
    wrong("no interrupt for FIFO 1", CAN1 + 0x14, 1 << 4, 0, "no answer to SDO"),
    missing("FIFO 1 is not released", CAN1 + 0x10, "no answer to SDO"),
    missing("FIFO 0 is not released", CAN1 + 0x0C, "reset by the chip (watchdog)"),
    missing("sent mailboxes are not acknowledged", CAN1 + 0x08, "reset by the chip (watchdog)"),
    unseen("nobody waits until FIFO 1 is released", CAN1 + 0x10, 1 << 5, "more than one answer to SDO")
        .with(Node::SlowFifo),
    wrong("no filter is active", CAN1 + 0x21C, u32::MAX, 0, "no answer to SDO"),
    wrong("time-triggered mode", CAN1, 1 << 7, 1 << 7, "CAN1"),
    wrong(
        "transceiver left asleep",
        GPIOB + BSRR,
        1 << 28 | 1 << 12,
        1 << 12,
        "CAN joins the bus with its transceiver asleep: PB12",
    ),
    wrong("CAN never leaves its initialisation", CAN1, 1 << 0, 1 << 0, "0 boot-up messages instead of one"),
    wrong("CAN left asleep", CAN1, 1 << 1, 1 << 1, "0 boot-up messages instead of one"),
    wrong("filters of FIFO 1 lead to FIFO 0", CAN1 + 0x214, u32::MAX, 0, "no answer to SDO"),
    wrong("filters of FIFO 0 lead to FIFO 1", CAN1 + 0x214, u32::MAX, 0x0FFF_FFFF, "the pressure is None"),
    wrong("filters left in their initialisation", CAN1 + 0x200, 1, 1, "no answer to SDO"),
    // ADC and DMA.
    wrong("temperature sampled for 3 cycles", ADC1 + 0x0C, 0b111 << 24, 0, "ADC channel 18 is sampled for"),
    wrong(
        "reference sampled for 15 cycles",
        ADC1 + 0x0C,
        0b111 << 21,
        1 << 21,
        "ADC channel 17 is sampled for",
    ),
    wrong("pressure sampled for 3 cycles", ADC1 + 0x10, 0b111, 0, "ADC channel 0 is sampled for 166 ns"),
    wrong(
        "supply of the transducer sampled for 3 cycles",
        ADC1 + 0x10,
        0b111 << 3,
        0,
        "ADC channel 1 is sampled for 166 ns",
    ),
    wrong(
        "thermistor sampled for 3 cycles",
        ADC1 + 0x0C,
        0b111 << 6,
        0,
        "ADC channel 12 is sampled for 166 ns",
    ),
    wrong("DMA to an odd address", DMA2 + 0x1C, 1, 1, "has an address that is no multiple of its width"),
    wrong("sensors of the chip off", ADC_CCR, 1 << 23, 0, "EMCY"),
    wrong("ADC without DMA", ADC1 + 0x08, 1 << 8, 0, "samples a second"),
    wrong("DMA of the ADC ends with a round", ADC1 + 0x08, 1 << 9, 0, "samples a second"),
    wrong("ADC not triggered", ADC1 + 0x08, 0b11 << 28, 0, "samples a second"),
    wrong("ADC converts a single channel", ADC1 + 0x04, 1 << 8, 0, "the pressure is"),
    wrong("ADC converts a channel less", ADC1 + 0x2C, 0xF << 20, 3 << 20, "the pressure is"),
    wrong("DMA to one place in memory", DMA2 + 0x10, 1 << 10, 0, "the pressure is"),
    wrong("DMA not circular", DMA2 + 0x10, 1 << 8, 0, "samples a second"),
    wrong("DMA without interrupts", DMA2 + 0x10, 0b11 << 3, 0, "samples a second"),
    wrong("DMA interrupts at the end only", DMA2 + 0x10, 1 << 3, 0, "500 samples a second"),
    wrong("DMA moves bytes", DMA2 + 0x10, 0b1111 << 11, 0, "the pressure is"),
    wrong("DMA moves half as much", DMA2 + 0x14, u32::MAX, 80, "samples a second"),
    missing("flags of the DMA are not cleared", DMA2 + 0x08, "reset by the chip (watchdog)"),
    wrong("ADC left-aligned", ADC1 + 0x08, 1 << 11, 1 << 11, "the pressure is"),
    wrong("ADC triggered by another timer", ADC1 + 0x08, 0xF << 24, 0, "reset by the chip (watchdog)"),
    wrong("ADC converts the supply first", ADC1 + 0x34, 0x1F, 1, "the pressure is"),
    wrong("ADC never switched on", ADC1 + 0x08, 1 << 0, 0, "reset by the chip (watchdog)"),
    wrong("DMA of another channel", DMA2 + 0x10, 0b111 << 25, 3 << 25, "reset by the chip (watchdog)"),
    wrong("DMA from memory", DMA2 + 0x10, 0b11 << 6, 0b01 << 6, "reset by the chip (watchdog)"),
    wrong(
        "DMA steps through registers",
        DMA2 + 0x10,
        1 << 9,
        1 << 9,
        "ADC1+0x50 (0x40012050) read: not modelled",
    ),
    wrong("DMA never enabled", DMA2 + 0x10, 1 << 0, 0, "reset by the chip (watchdog)"),
    // Timers.
    wrong("scans too fast", TIM3 + 0x2C, u32::MAX, 2249, "samples a second"),
    wrong("time base at half its rate", TIM2 + 0x28, u32::MAX, 143, "heartbeats instead of 5"),
    missing("flags of the time base are not cleared", TIM2 + 0x10, "reset by the chip (watchdog)"),
    wrong("encoder counts one phase", TIM4 + 0x08, 0b111, 1, "the position is").with(Node::Encoder),
    wrong("encoder counts to 4095", TIM4 + 0x2C, u32::MAX, 0xFFF, "the position is").with(Node::Encoder),
    wrong("counts are not copied", TIM3 + 0x0C, 1 << 8, 0, "samples a second").with(Node::Encoder),
    wrong("scans never start", TIM3, 1 << 0, 0, "reset by the chip (watchdog)"),
    wrong("scans do not trigger the ADC", TIM3 + 0x04, 0b111 << 4, 0, "reset by the chip (watchdog)"),
    wrong("time base stopped", TIM2, 1 << 0, 0, "reset by the chip (watchdog)"),
    wrong("encoder stopped", TIM4, 1 << 0, 0, "the position is").with(Node::Encoder),
    // SPI.
    wrong("SSI clock idles low", SPI2, 1 << 1, 0, "the position is").with(Node::Absolute),
    wrong("SSI sampled at the first edge", SPI2, 1 << 0, 0, "the position is").with(Node::Absolute),
    wrong("SSI clock too fast", SPI2, 0b111 << 3, 0, "the SSI clock at 18000000 Hz").with(Node::Absolute),
    wrong(
        "SSI clock pin at the lowest speed",
        GPIOB + OSPEEDR,
        0b11 << 26,
        0,
        "PB13 has the lowest output speed",
    )
    .with(Node::Absolute),
    wrong("SPI without DMA", SPI2 + 0x04, 0b11, 0, "the position is").with(Node::Absolute),
    missing("flags of DMA1 are not cleared", DMA1 + 0x08, "stream 3 of DMA1 begins with flags")
        .with(Node::Absolute),
    wrong("SSI lowest bit first", SPI2, 1 << 7, 1 << 7, "the position is").with(Node::Absolute),
    wrong("SPI never enabled", SPI2, 1 << 6, 0, "the position is").with(Node::Absolute),
    // Flash.
    wrong("voltage detector off", PWR_CR, 1 << 4, 0, "what was saved is lost").with(Node::LowSupply),
    missing("flash not unlocked", FLASH_KEYR, "a save is refused").with(Node::Saving),
    wrong("flash not in programming mode", FLASH_CR, 1 << 0, 0, "a save is refused").with(Node::Saving),
    wrong("flash erased by double words", FLASH_CR, 0b11 << 8, 0b11 << 8, "a save is refused")
        .with(Node::Saving),
    wrong("flash programmed by bytes", FLASH_CR, 0b11 << 8, 0, "a save is refused").with(Node::Saving),
    // Core.
    wrong("sampling not enabled in the NVIC", ISER1, 1 << (56 - 32), 0, "samples a second"),
    wrong("reception not enabled in the NVIC", ISER0, 0b11 << 20, 0, "no answer to SDO"),
    missing("floating-point unit off", CPACR, "CFSR 0x80000"),
    wrong("vector table elsewhere", VTOR, u32::MAX, 0x0804_0000, "fault at 0x"),
    wrong("vector table at a multiple of 128", VTOR, 0x1FF, 0x80, "is not aligned to 512 bytes"),
    wrong("watchdog too fast", IWDG + 0x08, 0xFFF, 10, "reset by the chip (watchdog)"),
];

/// The handler of the sampling task.
const SAMPLING: &str = "DMA2_STREAM0";
const RECEPTION: &str = "CAN1_RX1";

pub(super) const CODE: &[Row] = &[
    // b .
    code("an endless loop at a high priority", SAMPLING, &[0xE7FE], "reset by the chip (watchdog)"),
    // cpsid i; wfi; b .-2
    code(
        "sleep with interrupts masked",
        RECEPTION,
        &[0xB672, 0xBF30, 0xE7FD],
        "reset by the chip (watchdog)",
    ),
    // wfi; wfi; b .-4: one of the two is at no multiple of eight.
    code(
        "a sleep at any address in flash",
        SAMPLING,
        &[0xBF30, 0xBF30, 0xE7FC],
        "in flash with DBG_SLEEP set",
    ),
    // udf #0
    code("an undefined instruction", SAMPLING, &[0xDE00], "CFSR 0x10000"),
    // movs r0, #0; blx r0
    code("a call of a null pointer", SAMPLING, &[0x2000, 0x4780], "fault at 0x00000000"),
    // movs r0, #8; lsls r0, #24; blx r0
    code("a call to an even address", SAMPLING, &[0x2008, 0x0600, 0x4780], "CFSR 0x20000"),
    // movw r0, #0x0002; movt r0, #0x2000; ldrd r2, r3, [r0]
    code(
        "a double word at an odd half",
        SAMPLING,
        &[0xF240, 0x0002, 0xF2C2, 0x0000, 0xE9D0, 0x2300],
        "CFSR 0x1000000",
    )
    .with(Node::Interleaved),
    // movs r0, #0xF0; lsls r0, #24; ldr r0, [r0]
    code("a load from nowhere", SAMPLING, &[0x20F0, 0x0600, 0x6800], "CFSR 0x200, access to 0xf0000000"),
    // movs r0, #0xF0; lsls r0, #24; str r0, [r0]
    code("a store to nowhere", SAMPLING, &[0x20F0, 0x0600, 0x6000], "CFSR 0x400, access to 0xf0000000"),
    // push {r0-r7}; b .-2
    code("recursion without an end", SAMPLING, &[0xB4FF, 0xE7FD], "access to 0x1fffff"),
    // svc #0
    code("a supervisor call without a handler", SAMPLING, &[0xDF00], "reset by software"),
    // bkpt #0
    code("a breakpoint without a debugger", SAMPLING, &[0xBE00], "fault at 0x"),
    // movw r0, #0xED10; movt r0, #0xE000; movs r1, #4; str r1, [r0]; wfi
    code(
        "a sleep that stops the clocks",
        SAMPLING,
        &[0xF64E, 0x5010, 0xF2CE, 0x0000, 0x2104, 0x6001, 0xBF30, 0xE7FE],
        "SLEEPDEEP",
    ),
    // movw r0, #0xED9C; movt r0, #0xE000; movs r1, #0x10; str r1, [r0]; movs r1, #9; str r1, [r0, #4]
    code(
        "a guard of 32 bytes",
        SAMPLING,
        &[0xF64E, 0x509C, 0xF2CE, 0x0000, 0x2110, 0x6001, 0x2109, 0x6041, 0xE7FE],
        "less than a kilobyte that protects data",
    ),
    // bx lr
    code("a handler that clears nothing", RECEPTION, &[0x4770], "reset by the chip (watchdog)"),
    // movw r0, #0xED88; movt r0, #0xE000; movs r1, #0; str r1, [r0]; dsb; isb; vadd.f32 s0, s0, s0
    code(
        "floating point with the unit off",
        SAMPLING,
        &[0xF64E, 0x5088, 0xF2CE, 0x0000, 0x2100, 0x6001, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F, 0xEE30, 0x0A00],
        "CFSR 0x80000",
    ),
    // movw r0, #0x0002; movt r0, #0x2000; vldr s0, [r0]
    code(
        "a float at an odd half",
        SAMPLING,
        &[0xF240, 0x0002, 0xF2C2, 0x0000, 0xED90, 0x0A00],
        "CFSR 0x1000000",
    )
    .with(Node::Interleaved),
    // movw r0, #0x0002; movt r0, #0x2000; ldm r0, {r1, r2}
    code(
        "words at an odd half",
        SAMPLING,
        &[0xF240, 0x0002, 0xF2C2, 0x0000, 0xE890, 0x0006],
        "CFSR 0x1000000",
    )
    .with(Node::Interleaved),
    // movw r0, #0x0002; movt r0, #0x2000; ldrex r1, [r0]
    code(
        "an exclusive load at an odd half",
        SAMPLING,
        &[0xF240, 0x0002, 0xF2C2, 0x0000, 0xE850, 0x1F00],
        "CFSR 0x1000000",
    )
    .with(Node::Interleaved),
    // CCR, DIV_0_TRP: movw r0, #0xED14; movt r0, #0xE000; ldr r1, [r0]; orr r1, #0x10; str r1, [r0]; dsb; isb; movs r2, #0; udiv r1, r1, r2
    code(
        "a division by zero that is trapped",
        SAMPLING,
        &[
            0xF64E, 0x5014, 0xF2CE, 0x0000, 0x6801, 0xF041, 0x0110, 0x6001, 0xF3BF, 0x8F4F, 0xF3BF, 0x8F6F,
            0x2200, 0xFBB1, 0xF1F2,
        ],
        "CFSR 0x2000000",
    )
    .with(Node::Interleaved),
    // mvn lr, #10; bx lr
    code("an exception return that is none", SAMPLING, &[0xF06F, 0x0E0A, 0x4770], "CFSR 0x40000"),
    // mov r0, #0x40000000; orr r0, #1; bx r0
    code(
        "a call into the peripherals",
        SAMPLING,
        &[0xF04F, 0x4080, 0xF040, 0x0001, 0x4700],
        "fault at 0x40000000, CFSR 0x100",
    ),
    // mov r0, #0x20000000; orr r0, #1; bx r0
    code("a call into the RAM", SAMPLING, &[0xF04F, 0x5000, 0xF040, 0x0001, 0x4700], "fault at 0x2000"),
    // Interrupt 63, CAN2_TX, is enabled and pended: movw r0, #0xE204; movt r0, #0xE000; mov r1, #0x80000000; movw r2, #0xE104; movt r2, #0xE000; str r1, [r2]; str r1, [r0]; bx lr
    code(
        "an interrupt without a handler",
        SAMPLING,
        &[
            0xF24E, 0x2004, 0xF2CE, 0x0000, 0xF04F, 0x4100, 0xF24E, 0x1204, 0xF2CE, 0x0200, 0x6011, 0x6001,
            0x4770,
        ],
        "reset by software",
    ),
    // cpsid i; bx lr
    code("interrupts masked for ever", SAMPLING, &[0xB672, 0x4770], "reset by the chip (watchdog)"),
    // cpsid f; b .
    code("faults masked in a loop", SAMPLING, &[0xB671, 0xE7FE], "reset by the chip (watchdog)"),
    // movs r0, #0; str r0, [r0]; b .
    code("a store to a null pointer", SAMPLING, &[0x2000, 0x6000, 0xE7FE], "access to 0x00000000"),
    // movs r0, #0; msr msp, r0; push {r0}; b .
    code("a stack at zero", SAMPLING, &[0x2000, 0xF380, 0x8808, 0xB401, 0xE7FE], "CFSR 0x1000"),
    // movw r0, #0x7400; movt r0, #0x4000; ldr r1, [r0]; bx lr
    code(
        "a register of a peripheral without its clock",
        SAMPLING,
        &[0xF247, 0x4000, 0xF2C4, 0x0000, 0x6801, 0x4770],
        "DAC is accessed without its clock",
    ),
];
