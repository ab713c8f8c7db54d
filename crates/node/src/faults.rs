//! Faults: from the sensor, from the bus, and from the firmware.

use crate::profile::Profile;
use crate::{BusEvent, Protocol, Snapshot};
use canopen::emcy::Fault;
use canopen::{Instant, Transmit};
use profiles::{encoder, lift, pressure};

/// Sub-indexes of 1029h.
const COMMUNICATION_ERROR: u8 = 1;
const DEVICE_ERROR: u8 = 2;

/// What the measurement finds wrong.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Conditions {
    pressure: pressure::Conditions,
    encoder: encoder::Conditions,
}

impl Conditions {
    /// What is not measured has no fault.
    pub(crate) fn of(snapshot: &Snapshot) -> Conditions {
        if let Some(lift) = &snapshot.lift {
            return Conditions::of_lift(lift);
        }
        Conditions {
            pressure: snapshot.pressure.map(|values| values.conditions).unwrap_or_default(),
            encoder: snapshot.encoder.map(|values| values.conditions).unwrap_or_default(),
        }
    }

    /// The load measuring unit is on the pressure input, the position units are on those of the encoder.
    fn of_lift(snapshot: &lift::Snapshot) -> Conditions {
        let sensor_break = snapshot.load.is_broken;
        let pressure = pressure::Conditions { sensor_break, ..pressure::Conditions::default() };
        Conditions { pressure, encoder: snapshot.position.conditions }
    }

    fn faults(self) -> [(Fault, bool); 7] {
        let Conditions { pressure, encoder } = self;
        [
            (Fault::SensorBreak, pressure.sensor_break),
            (Fault::PressureRail, pressure.pressure_rail),
            (Fault::TemperatureRail, pressure.temperature_rail),
            (Fault::EncoderBreak, encoder.sensor_break),
            (Fault::InputCurrent, encoder.current),
            (Fault::InputVoltage, encoder.voltage),
            (Fault::HardwareMemory, encoder.memory),
        ]
    }
}

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

    /// Sets or clears a fault that the firmware has found: in the flags of 3000h where there are any, the error register
    /// and an EMCY.
    pub fn set_fault(&mut self, fault: Fault, active: bool, now: Instant, out: &mut impl Transmit) {
        let has_flag = self.device.application_mut().flags.set(fault, active);
        self.device.show(Profile::show_flags);
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
        let changes = old.faults().into_iter().zip(new.faults()).filter(|(old, new)| old != new);
        for (_, (fault, active)) in changes {
            self.set_fault(fault, active, now, out);
        }
    }
}
