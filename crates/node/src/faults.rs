//! Faults: from the sensor, from the bus, and from the firmware.

use crate::{BusEvent, Protocol};
use canopen::emcy::Fault;
use canopen::{Instant, Transmit};
use profiles::pressure::Conditions;

/// Sub-indexes of 1029h.
const COMMUNICATION_ERROR: u8 = 1;
const DEVICE_ERROR: u8 = 2;

impl Protocol {
    /// Takes note of an event on the bus.
    pub fn bus_event(&mut self, event: BusEvent, now: Instant, out: &mut impl Transmit) {
        match event {
            // A warning has no emergency code: the node works, and error passive would follow.
            BusEvent::Warning => (),
            BusEvent::Overrun => {
                self.device.raise(Fault::Overrun, now);
                self.device.clear(Fault::Overrun, now);
            }
            BusEvent::Passive => self.device.raise(Fault::ErrorPassive, now),
            BusEvent::BusOff => {
                self.is_bus_off = true;
                self.device.apply_error_behaviour(COMMUNICATION_ERROR);
            }
            BusEvent::Recovered => self.recover(now),
        }
        self.device.poll_services(now, out);
    }

    /// That the node was off the bus can only be said afterwards.
    fn recover(&mut self, now: Instant) {
        if core::mem::take(&mut self.is_bus_off) {
            self.device.raise(Fault::BusOffRecovered, now);
        }
        self.device.clear(Fault::ErrorPassive, now);
        self.device.clear(Fault::BusOffRecovered, now);
    }

    /// Sets or clears a fault that the firmware has found: in the flags of 3000h, the error register and an EMCY.
    pub fn set_fault(&mut self, fault: Fault, active: bool, now: Instant, out: &mut impl Transmit) {
        let profile = self.device.application_mut();
        let has_flag = profile.flags.set(fault, active);
        let flags = profile.flags;
        flags.store(self.device.image_mut());
        if active {
            self.device.raise(fault, now);
        } else {
            self.device.clear(fault, now);
        }
        if active && has_flag {
            self.device.apply_error_behaviour(DEVICE_ERROR);
        }
        self.device.poll_services(now, out);
    }

    /// Turns the conditions that have changed into faults.
    pub(crate) fn take_conditions(&mut self, new: Conditions, now: Instant, out: &mut impl Transmit) {
        let old = core::mem::replace(&mut self.conditions, new);
        let changes = [
            (Fault::SensorBreak, old.sensor_break, new.sensor_break),
            (Fault::PressureRail, old.pressure_rail, new.pressure_rail),
            (Fault::TemperatureRail, old.temperature_rail, new.temperature_rail),
        ];
        for (fault, _, active) in changes.into_iter().filter(|(_, old, new)| old != new) {
            self.set_fault(fault, active, now, out);
        }
    }
}
