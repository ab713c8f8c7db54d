//! The seam between the core (CPU, NVIC, system control space) and the chip around it.

use std::ops::Range;

use canbus::Time;

use crate::rules::Breach;

/// Levels of the chip's interrupt lines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct IrqLines {
    /// Bit `n` is IRQ `n` of the vector table.
    pub irqs: u128,
    /// The interrupt that no program can mask.
    pub nmi: bool,
}

impl IrqLines {
    /// Sets or clears one line.
    pub fn set(&mut self, irq: u8, level: bool) {
        self.irqs = self.irqs & !(1 << irq) | u128::from(level) << irq;
    }

    /// Adds one line to those that are up. Most are down most of the time.
    #[inline]
    pub(crate) fn raise(&mut self, irq: u8, level: bool) {
        if level {
            self.irqs |= 1 << irq;
        }
    }
}

/// The bus answered an access with an error: the core raises a BusFault.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BusFault;

/// How the core reads the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FlashAccess {
    /// Cycles that a read takes longer than one.
    pub wait_states: u32,
    /// The cache of code is on.
    pub caches_code: bool,
    /// The cache of constants is on.
    pub caches_constants: bool,
}

/// What the chip wants done outside of itself, in order.
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
    /// The core clock (HCLK) is now this, in hertz.
    CoreClock(u64),
    /// A reset that the chip itself asks for (watchdog); RCC already holds its cause.
    Reset,
    /// Power is gone: RAM is lost, flash keeps what it had.
    PowerCut,
    /// The world must look at the bus before the core runs on: a transmit request, a bit-rate change.
    Poke,
}

/// Reads memory for a DMA transfer out of it.
pub trait Memory {
    /// Reads `bytes.len()` bytes at an absolute address of RAM or flash.
    fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault>;
}

/// Everything of the chip outside the core. All calls come in the order of virtual time.
pub trait Peripherals {
    /// A read of 1, 2 or 4 bytes at an absolute address.
    fn read(&mut self, address: u32, size: u8, now: Time) -> Result<u32, BusFault>;

    /// A write of 1, 2 or 4 bytes at an absolute address.
    fn write(&mut self, address: u32, size: u8, value: u32, now: Time) -> Result<(), BusFault>;

    /// A store by the core into the flash array: programming, when the controller allows it. `old` is what the
    /// array holds at `address`, as many bytes as are written.
    fn program(&mut self, address: u32, old: &[u8], new: &[u8], now: Time) -> Result<(), BusFault>;

    /// HCLK divided by the clock of the APB bus on which this address lies; `None` for one on an AHB bus.
    fn apb_divider(&self, _address: u32) -> Option<u32> {
        None
    }

    /// How the core reads the flash now.
    fn flash_access(&self) -> FlashAccess {
        FlashAccess { wait_states: 0, caches_code: true, caches_constants: true }
    }

    /// The next instant at which something happens without the core.
    fn deadline(&self) -> Time;

    /// Lets everything due up to `now` happen.
    fn advance(&mut self, now: Time, memory: &dyn Memory);

    /// The interrupt lines now.
    fn lines(&self) -> IrqLines;

    /// Whether there may be another deadline, level of a line, broken rule or effect than when this was last asked. What the
    /// bus does to the CAN controllers meanwhile does not count.
    fn take_change(&mut self) -> bool {
        true
    }

    /// Takes the next rule that was found broken, each once.
    fn breach(&mut self) -> Option<Breach> {
        None
    }

    /// Takes the next effect that earlier calls asked for.
    fn effect(&mut self) -> Option<Effect>;

    /// A system reset by the core (SYSRESETREQ) or, with `power`, by the supply.
    fn reset(&mut self, power: bool, now: Time);
}
