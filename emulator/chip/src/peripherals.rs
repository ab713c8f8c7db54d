//! The interface between the core (CPU, NVIC, system control space) and the chip around it.

use std::ops::Range;

use canbus::Time;

use crate::breach::Breach;

/// Levels of the chip's interrupt lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IrqLines {
    /// Bit `n` is IRQ `n` of the vector table.
    pub irqs: u128,
    /// The NMI line.
    pub nmi: bool,
}

impl IrqLines {
    /// Sets or clears one line.
    pub fn set(&mut self, irq: u8, level: bool) {
        self.irqs = self.irqs & !(1 << irq) | u128::from(level) << irq;
    }

    /// Sets one line if `level` is high. Most lines are low most of the time.
    #[inline]
    pub(crate) fn raise(&mut self, irq: u8, level: bool) {
        if level {
            self.irqs |= 1 << irq;
        }
    }
}

/// The bus answered an access with an error; the core raises a BusFault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFault;

/// The settings for reads of the flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FlashAccess {
    /// Extra cycles of a read.
    pub wait_states: u32,
    /// The instruction cache is on.
    pub caches_code: bool,
    /// The data cache is on.
    pub caches_constants: bool,
    /// How often the program has emptied the instruction cache.
    pub code_resets: u32,
    /// How often it has emptied the data cache.
    pub constant_resets: u32,
}

/// A request of the chip to its environment; requests are carried out in order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Write bytes to RAM (a DMA transfer) or to the flash array (programming, erase).
    Store {
        /// Absolute address.
        address: u32,
        /// The bytes.
        bytes: Vec<u8>,
    },
    /// Fill flash (an erase).
    Fill {
        /// Absolute addresses.
        range: Range<u32>,
        /// The value of every byte.
        byte: u8,
    },
    /// Code fetch and reads from flash wait until this instant.
    StallFlash(Time),
    /// The core clock (HCLK) changes to this frequency in hertz.
    CoreClock(u64),
    /// The chip requests a reset (watchdog); RCC has already recorded the cause.
    Reset,
    /// Power is lost: RAM loses its content, flash keeps it.
    PowerCut,
    /// The bus must see a change before the core continues: a transmit request or a change of the bit rate.
    Poke,
}

/// Reads memory for a DMA transfer from memory.
pub trait Memory {
    /// Reads `bytes.len()` bytes at an absolute address of RAM or flash.
    fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault>;
}

/// The chip without its core. All calls come in the order of virtual time.
pub trait Peripherals {
    /// A read of 1, 2 or 4 bytes at an absolute address.
    fn read(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault>;

    /// A write of 1, 2 or 4 bytes at an absolute address.
    fn write(&mut self, address: u32, size: u8, value: u32, now: Time) -> Result<(), BusFault>;

    /// A store by the core into the flash array: programming, if the controller allows it. `old` is the content at
    /// `address`, as long as `new`.
    fn program(&mut self, address: u32, old: &[u8], new: &[u8], now: Time) -> Result<(), BusFault>;

    /// The divider from HCLK to the APB bus of this address; `None` for an address on an AHB bus.
    fn apb_divider(&self, _address: u32) -> Option<u32> {
        None
    }

    /// Number of interrupts of the vector table.
    fn interrupts(&self) -> u32 {
        97
    }

    /// HCLK cycles until a store that has arrived at this address is in force.
    fn settling(&self, _address: u32) -> u32 {
        0
    }

    /// The current settings for reads of the flash.
    fn flash_access(&self) -> FlashAccess {
        FlashAccess { caches_code: true, caches_constants: true, ..FlashAccess::default() }
    }

    /// The next instant at which the state changes without an access by the core.
    fn deadline(&self) -> Time;

    /// Processes everything that is due up to `now`.
    fn advance(&mut self, now: Time, memory: &dyn Memory);

    /// The current levels of the interrupt lines.
    fn lines(&self) -> IrqLines;

    /// The core sleeps by a WFI at this address.
    fn slept(&mut self, _address: u32) {}

    /// Whether the deadline, a line, a broken rule or an effect may have changed since the last call. Changes that the
    /// bus makes in the CAN controllers do not count.
    fn take_change(&mut self) -> bool {
        true
    }

    /// Takes the next broken rule; each rule is reported once.
    fn breach(&mut self) -> Option<Breach> {
        None
    }

    /// Takes the next effect that earlier calls have requested.
    fn effect(&mut self) -> Option<Effect>;

    /// A system reset: by the core (SYSRESETREQ) or, with `power`, by the supply.
    fn reset(&mut self, power: bool, now: Time);
}
