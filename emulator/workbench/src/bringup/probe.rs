//! A debug probe on the first board of a world, which keeps running meanwhile.

use canbus::Time;
use chip::{BusFault, Peripherals};
use programmer::protect::Registers;
use sim::world::World;

/// The duration of an access by a fast probe.
const ACCESS: Time = Time::from_millis(20);

/// The probe.
pub struct Probe<'w>(pub &'w mut World);

impl Probe<'_> {
    fn pause(&mut self) -> Time {
        self.0.run_until(self.0.now() + ACCESS);
        self.0.now()
    }
}

impl Registers for Probe<'_> {
    type Error = BusFault;

    fn read(&mut self, address: u32) -> Result<u32, BusFault> {
        let now = self.pause();
        self.0.machine(0).peripherals_mut().read(address, 4, now)
    }

    fn write(&mut self, address: u32, value: u32) -> Result<(), BusFault> {
        let now = self.pause();
        self.0.machine(0).peripherals_mut().write(address, 4, value, now)
    }
}
