//! Stores on their way to a peripheral, in the mode that steps through instructions. The core does not wait for a store:
//! its write buffer and the bridges to the APB buses take it, and it arrives some cycles later (Cortex-M4 technical
//! reference manual, 2.3.2; AMBA 3 APB, 2.1). Until then an interrupt line, a clock or a lock is as it was before.
//!
//! A load waits for earlier stores to the same bus, and DSB and DMB wait for all. Nothing else does: not an access to another
//! bus or to the system space, not a return from an exception. A store to an APB bus waits for the one before it.

use canbus::Time;
use chip::Peripherals;

use crate::core::{Core, Halt};

/// A bus of the peripherals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bus {
    Ahb,
    Apb1,
    Apb2,
}

impl Bus {
    fn of(address: u32) -> Bus {
        match address >> 16 {
            0x4000 => Bus::Apb1,
            0x4001 => Bus::Apb2,
            _ => Bus::Ahb,
        }
    }
}

/// The stores on their way.
#[derive(Clone, Debug, Default)]
pub(crate) struct Posted(Vec<Store>);

/// A store on its way.
#[derive(Clone, Copy, Debug)]
struct Store {
    bus: Bus,
    /// The end of the transfer.
    arrives: Time,
    /// The instant from which on it has its effect.
    acts: Time,
    address: u32,
    size: u8,
    value: u32,
}

impl Posted {
    /// The instant at which the next store has its effect.
    pub(crate) fn deadline(&self) -> Time {
        self.0.iter().map(|store| store.acts).min().unwrap_or(Time::NEVER)
    }

    /// The next store that has its effect now.
    fn take(&mut self, now: Time) -> Option<Store> {
        let next = self.deadline();
        let place = self.0.iter().position(|store| store.acts == next && next <= now)?;
        Some(self.0.remove(place))
    }

    /// The stores to a bus.
    fn to(&self, bus: Bus) -> impl Iterator<Item = &Store> {
        self.0.iter().filter(move |store| store.bus == bus)
    }
}

/// Whether the instruction is DSB or DMB (ARMv7-M, A7.7.33 and A7.7.34).
pub(crate) fn is_barrier(code: &[u8]) -> bool {
    matches!(code, [0xBF, 0xF3, 0x40..=0x5F, 0x8F, ..])
}

impl<P: Peripherals> Core<P> {
    /// Sends a store of the program to a peripheral: it arrives at once, or later in the mode that steps.
    pub(crate) fn send(&mut self, address: u32, size: usize, value: u32) {
        if self.stepping.is_none() || !self.scb.buffers(address) {
            self.wait_for_bus(address, false);
            return self.store(address, size as u8, value);
        }
        let (bus, divider) = (Bus::of(address), self.chip.apb_divider(address));
        if divider.is_some() {
            // A bridge has a place for one store only.
            self.wait_for_stores(address);
        }
        let Some(stepping) = &mut self.stepping else { return };
        let (fewest, most) = divider.map_or((1, 2), |divider| (2 * divider, 5 * divider));
        let cycles = stepping.either(fewest, most);
        let cycle = |count: u32| Time(self.cycle.0 * u64::from(count));
        // One transfer after the other.
        let free = self.posted.to(bus).map(|store| store.arrives + cycle(1)).max().unwrap_or(self.now);
        let arrives = free.max(self.now + cycle(cycles));
        let acts = arrives + cycle(self.chip.settling(address));
        self.posted.0.push(Store { bus, arrives, acts, address, size: size as u8, value });
        self.due_is_new();
    }

    /// Waits until earlier stores to the bus of this address have their effect.
    pub(crate) fn wait_for_stores(&mut self, address: u32) {
        self.deliver();
        let last = self.posted.to(Bus::of(address)).map(|store| store.acts).max();
        self.wait_until(last.unwrap_or(self.now));
    }

    /// Waits until all stores have arrived: DSB or DMB at this address.
    pub(crate) fn wait_at_barrier(&mut self, address: u32) {
        if self.stepping.as_ref().is_some_and(|stepping| !stepping.omits(address)) {
            let last = self.posted.0.iter().map(|store| store.acts).max();
            self.wait_until(last.unwrap_or(self.now));
        }
    }

    fn wait_until(&mut self, instant: Time) {
        if instant <= self.now {
            return;
        }
        let cycles = instant.since(self.now).0.div_ceil(self.cycle.0);
        self.spend(0, cycles as u32);
        self.deliver();
    }

    /// Hands over the stores that have arrived.
    pub(crate) fn deliver(&mut self) {
        while let Some(store) = self.posted.take(self.now) {
            self.store(store.address, store.size, store.value);
        }
    }

    /// A store that has arrived: handles effects and interrupts, or a fault when no register answered.
    fn store(&mut self, address: u32, size: u8, value: u32) {
        let result = self.chip.write(address, size, value, self.now);
        self.finish_store(address, result.ok());
    }

    /// Ends a store into the chip or the system space.
    pub(crate) fn finish_store(&mut self, address: u32, answer: Option<()>) {
        match answer {
            None if self.scb.buffers(address) => self.lost_store = Some(address),
            None => self.stop_for(Halt::DataFault(address)),
            Some(()) => {}
        }
        self.settle();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stores_act_in_the_order_of_their_times() {
        let store = |acts, address| {
            let (bus, acts) = (Bus::of(address), Time(acts));
            Store { bus, arrives: acts, acts, address, size: 4, value: 0 }
        };
        let mut posted = Posted(vec![store(9, 0x4000_0000), store(5, 0x4002_0000)]);
        assert_eq!(posted.deadline(), Time(5));
        assert!(posted.take(Time(4)).is_none());
        assert_eq!(posted.take(Time(9)).map(|store| store.address), Some(0x4002_0000));
        assert_eq!(posted.take(Time(9)).map(|store| store.address), Some(0x4000_0000));
        assert!(posted.take(Time(9)).is_none() && posted.deadline() == Time::NEVER);
    }

    #[test]
    fn barriers() {
        assert!(is_barrier(&[0xBF, 0xF3, 0x4F, 0x8F]) && is_barrier(&[0xBF, 0xF3, 0x5F, 0x8F, 0]));
        assert!(!is_barrier(&[0xBF, 0xF3, 0x6F, 0x8F]), "ISB");
        assert!(!is_barrier(&[0xBF, 0xF3, 0x2F, 0x8F]), "CLREX");
    }
}
