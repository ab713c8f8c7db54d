//! Faults: from the sensor, from the bus, and from the firmware.

use crate::{BusEvent, Fault, Next, Protocol, Snapshot};
use canopen::{ErrorClass, Instant};
use profiles::{encoder, lift, pressure};

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
    pub fn bus_event(&mut self, event: BusEvent, now: Instant) -> Next {
        self.device.on_bus(event, now)
    }

    /// Sets or clears a fault that the firmware has found: in the flags of 3000h where there are any, the error register
    /// and an EMCY.
    pub fn set_fault(&mut self, fault: Fault, active: bool, now: Instant) -> Next {
        let has_flag = self.device.application_mut().flags.set(fault, active);
        self.device.show(|profile, image| profile.show_flags(image));
        let next = self.device.set_condition(fault.number(), active, now);
        if active && has_flag { self.device.error(ErrorClass::DEVICE) } else { next }
    }

    /// Turns the conditions that have changed into faults. The services send them.
    pub(crate) fn take_conditions(&mut self, new: Conditions, now: Instant) {
        let old = core::mem::replace(&mut self.conditions, new);
        let changes = old.faults().into_iter().zip(new.faults()).filter(|(old, new)| old != new);
        for (_, (fault, active)) in changes {
            let _ = self.set_fault(fault, active, now);
        }
    }
}
