//! A program that accesses the chip by address, and its memory.

use std::collections::BTreeMap;

use canbus::Time;
use chip::{Board, BusFault, Effect, Memory, Peripherals, Stm32f4, Variant};

pub(crate) const RCC: u32 = 0x4002_3800;
pub(crate) const AHB1ENR: u32 = RCC + 0x30;
pub(crate) const APB1ENR: u32 = RCC + 0x40;
pub(crate) const APB2ENR: u32 = RCC + 0x44;

/// RAM and flash, one entry for each byte.
#[derive(Default)]
pub(crate) struct Bytes(pub(crate) BTreeMap<u32, u8>);

impl Memory for Bytes {
    fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        for (address, byte) in (address..).zip(bytes) {
            *byte = *self.0.get(&address).ok_or(BusFault)?;
        }
        Ok(())
    }
}

/// The chip, its memory and the current instant of the program.
pub(crate) struct Rig {
    pub(crate) chip: Stm32f4,
    pub(crate) memory: Bytes,
    pub(crate) now: Time,
    /// Effects other than stores to memory.
    pub(crate) effects: Vec<Effect>,
}

impl Rig {
    pub(crate) fn new() -> Self {
        Self::with(Variant::F446)
    }

    pub(crate) fn with(variant: Variant) -> Self {
        let chip = Stm32f4::new(variant, Board::default());
        let mut rig = Self { chip, memory: Bytes::default(), now: Time::ZERO, effects: Vec::new() };
        rig.take_effects();
        rig
    }

    pub(crate) fn read(&mut self, address: u32) -> u32 {
        let value = self.chip.read(address, 4, self.now).expect("an address of the chip");
        self.take_effects();
        value
    }

    pub(crate) fn write(&mut self, address: u32, value: u32) {
        self.chip.write(address, 4, value, self.now).expect("an address of the chip");
        self.take_effects();
    }

    /// Sets bits by reading and writing.
    pub(crate) fn set(&mut self, address: u32, bits: u32) {
        let value = self.read(address) | bits;
        self.write(address, value);
    }

    /// A store by the program into flash.
    pub(crate) fn program(&mut self, address: u32, new: &[u8]) {
        let old: Vec<u8> = (address..).take(new.len()).map(|a| self.byte(a)).collect();
        self.chip.program(address, &old, new, self.now).expect("flash");
        self.take_effects();
    }

    /// A byte of memory; an address that was never written is erased flash.
    pub(crate) fn byte(&self, address: u32) -> u8 {
        self.memory.0.get(&address).copied().unwrap_or(0xFF)
    }

    pub(crate) fn half_word(&self, address: u32) -> u16 {
        u16::from_le_bytes([self.byte(address), self.byte(address + 1)])
    }

    /// Advances to an instant, stopping at every deadline of the chip.
    pub(crate) fn run_to(&mut self, until: Time) {
        while self.chip.deadline() <= until {
            self.now = self.now.max(self.chip.deadline());
            self.chip.advance(self.now, &self.memory);
            self.take_effects();
        }
        self.now = until;
    }

    pub(crate) fn wait(&mut self, span: Time) {
        self.run_to(self.now + span);
    }

    /// Advances until an interrupt line is set and returns the instant; `None` when the line stays low for `limit`.
    pub(crate) fn run_to_irq(&mut self, irq: u8, limit: Time) -> Option<Time> {
        let end = self.now + limit;
        while self.chip.lines().irqs >> irq & 1 == 0 {
            let next = self.chip.deadline();
            if next > end {
                return None;
            }
            self.run_to(next);
        }
        Some(self.now)
    }

    pub(crate) fn irq(&self, irq: u8) -> bool {
        self.chip.lines().irqs >> irq & 1 != 0
    }

    fn take_effects(&mut self) {
        while let Some(effect) = self.chip.effect() {
            match effect {
                Effect::Store { address, bytes } => {
                    self.memory.0.extend((address..).zip(bytes));
                }
                Effect::Fill { range, byte } => self.memory.0.extend(range.map(|address| (address, byte))),
                other => self.effects.push(other),
            }
        }
    }

    /// The clock tree of the firmware: HSE 8 MHz, HCLK 144 MHz, APB1 36 MHz, APB2 72 MHz.
    pub(crate) fn firmware_clocks(&mut self) {
        self.write(RCC, 0x0005_0083);
        self.wait(Time::from_micros(10));
        self.write(RCC + 4, 4 | 144 << 6 | 1 << 22 | 2 << 24);
        self.set(RCC, 1 << 24);
        self.wait(Time::from_micros(200));
        self.write(RCC + 8, 0b101 << 10 | 0b100 << 13);
        self.set(RCC + 8, 2);
    }
}
