//! The physical world around the chip: pressure, temperature, shaft and buttons, and the board's circuits between these
//! and the chip.

mod button;
mod fault;
pub(crate) mod front_end;
mod shaft;
mod signal;
mod spec;
mod table;

use canbus::Time;

use crate::board::{BUTTONS, Board};
use crate::spi::Reading;

use button::Button;
pub use button::{Push, PushError};
pub use fault::{Fault, FaultError, FaultKind, FaultSwitch};
pub use front_end::{FrontEnd, Rails};
pub use shaft::Motion;
pub(crate) use shaft::first_change;
use shaft::{Shaft, phases};
pub use signal::Signal;
use signal::Stimulus;
pub use spec::SpecError;
pub use table::{Table, TableError};

/// The supply of the chip in volts.
const SUPPLY: f64 = 3.3;
/// The time between two bounces of the incremental encoder: longer than the filter of the timer's inputs, and no part of
/// the period of the samples.
const BOUNCE: Time = Time::from_micros(23);

/// The quantities that the sensors measure, the supply, and the faults.
#[derive(Clone, Debug)]
pub struct Plant {
    pressure: Stimulus,
    temperature: Stimulus,
    thermistor: Stimulus,
    supply: Stimulus,
    shaft: Shaft,
    buttons: [Button; BUTTONS],
    faults: Vec<Fault>,
    front_end: FrontEnd,
    /// Supplies of the board.
    pub rails: Rails,
}

impl Plant {
    /// The world of a board: no pressure, 25 degrees Celsius everywhere, a supply of 3.3 V, the shaft at rest at 0, no button
    /// pressed.
    pub(crate) fn new(board: &Board) -> Self {
        let still = |value| Stimulus::new(Signal::Constant(value), Time::ZERO);
        Self {
            pressure: still(0.0),
            temperature: still(298.15),
            thermistor: still(298.15),
            supply: still(SUPPLY),
            shaft: Shaft::new(board.encoder_lines),
            buttons: [Button::default(); BUTTONS],
            faults: Vec::new(),
            front_end: board.front_end,
            rails: Rails::new(&board.front_end),
        }
    }

    /// Sets the pressure, in pascal, from `now` on.
    pub fn set_pressure(&mut self, signal: Signal, now: Time) {
        self.pressure = Stimulus::new(signal, now);
    }

    /// Sets the temperature of the chip, in kelvin, from `now` on.
    pub fn set_temperature(&mut self, signal: Signal, now: Time) {
        self.temperature = Stimulus::new(signal, now);
    }

    /// Sets the temperature of the thermistor, in kelvin, from `now` on.
    pub fn set_thermistor(&mut self, signal: Signal, now: Time) {
        self.thermistor = Stimulus::new(signal, now);
    }

    /// Sets the supply of the chip, in volts, from `now` on.
    pub fn set_supply(&mut self, signal: Signal, now: Time) {
        self.supply = Stimulus::new(signal, now);
    }

    /// Sets the motion of the shaft from `now` on; even motion starts at the current position.
    pub fn set_shaft(&mut self, motion: Motion, now: Time) {
        self.shaft.set(motion, now);
    }

    /// Presses or releases a button at `now`; a button that the board does not have is ignored.
    pub fn push(&mut self, push: Push, now: Time) {
        if let Some(button) = self.buttons.get_mut(push.button) {
            button.set(push.down, now);
        }
    }

    /// Adds a fault; its times are absolute.
    pub fn add_fault(&mut self, fault: Fault) {
        self.faults.push(fault);
    }

    /// Begins or ends a fault at `now`. Other faults of the same kind, also later ones, are removed.
    pub fn switch_fault(&mut self, FaultSwitch { kind, is_on }: FaultSwitch, now: Time) {
        self.faults.retain(|fault| fault.kind != kind);
        if is_on {
            self.faults.push(Fault { kind, from: now, until: Time::NEVER });
        }
    }

    /// The faults that are active at `now`.
    pub fn faults(&self, now: Time) -> impl Iterator<Item = FaultKind> {
        FaultKind::all().filter(move |kind| self.has(*kind, now))
    }

    /// Removes all faults.
    pub fn clear_faults(&mut self) {
        self.faults.clear();
    }

    /// The signal of the pressure.
    pub fn pressure_signal(&self) -> &Signal {
        self.pressure.signal()
    }

    /// The signal of the temperature of the chip.
    pub fn temperature_signal(&self) -> &Signal {
        self.temperature.signal()
    }

    /// The signal of the temperature of the thermistor.
    pub fn thermistor_signal(&self) -> &Signal {
        self.thermistor.signal()
    }

    /// The signal of the supply of the chip.
    pub fn supply_signal(&self) -> &Signal {
        self.supply.signal()
    }

    /// The motion of the shaft.
    pub fn motion(&self) -> &Motion {
        self.shaft.motion()
    }

    /// The buttons that are held down.
    pub fn held(&self) -> [bool; BUTTONS] {
        self.buttons.map(|button| button.is_down())
    }

    /// The true temperature of the thermistor in kelvin.
    pub fn thermistor(&self, now: Time) -> f64 {
        self.thermistor.at(now)
    }

    /// The circuits between sensors and chip.
    pub fn front_end(&self) -> &FrontEnd {
        &self.front_end
    }

    /// The supply of the chip in volts.
    pub fn supply(&self, now: Time) -> f64 {
        self.supply.at(now)
    }

    /// The true pressure in pascal.
    pub fn pressure(&self, now: Time) -> f64 {
        self.pressure.at(now)
    }

    /// The true temperature in kelvin.
    pub fn temperature(&self, now: Time) -> f64 {
        self.temperature.at(now)
    }

    /// The true position of the shaft in revolutions.
    pub fn revolutions(&self, now: Time) -> f64 {
        self.shaft.revolutions(now)
    }

    /// PA0 as a ratio of VDDA.
    pub(crate) fn pressure_input(&self, now: Time) -> f64 {
        let output = if self.has(FaultKind::RailHigh, now) {
            1.0
        } else if self.has(FaultKind::RailLow, now) || self.has(FaultKind::OpenSensor, now) {
            0.0
        } else {
            self.front_end.transducer(self.pressure(now))
        };
        self.front_end.output_ratio(output, self.rails)
    }

    /// PA1 as a ratio of VDDA.
    pub(crate) fn supply_input(&self) -> f64 {
        self.front_end.supply_ratio(self.rails)
    }

    /// PC2 as a ratio of VDDA.
    pub(crate) fn thermistor_input(&self, now: Time) -> f64 {
        if self.has(FaultKind::OpenThermistor, now) {
            1.0
        } else if self.has(FaultKind::ShortedThermistor, now) {
            0.0
        } else {
            self.front_end.thermistor(self.thermistor.at(now))
        }
    }

    /// The temperature sensor as a ratio of VDDA.
    pub(crate) fn temperature_input(&self, now: Time) -> f64 {
        self.rails.temperature_ratio(self.temperature(now))
    }

    /// VREFINT as a ratio of VDDA.
    pub(crate) fn reference_input(&self) -> f64 {
        self.rails.reference_ratio()
    }

    /// The incremental encoder's position in quarter periods.
    pub(crate) fn quarter(&self, now: Time) -> i64 {
        self.shaft.quarter(now) + i64::from(self.bounces(now))
    }

    /// Whether the incremental encoder is one step ahead, every other time.
    fn bounces(&self, now: Time) -> bool {
        self.has(FaultKind::Bounce, now) && !(now.0 / BOUNCE.0).is_multiple_of(2)
    }

    /// Levels of the encoder's A and B.
    pub(crate) fn phases(&self, now: Time) -> (bool, bool) {
        phases(self.quarter(now))
    }

    /// Level of the encoder's index.
    pub(crate) fn index(&self, now: Time) -> bool {
        let (started, ended) = self.shaft.index_edges(now);
        started != ended && !self.has(FaultKind::MissingIndex, now)
    }

    /// The reading of the absolute encoder; `None` when its data line is broken.
    pub(crate) fn absolute(&self, now: Time) -> Option<Reading> {
        let half_off = if self.has(FaultKind::WrongCode, now) { 0.5 } else { 0.0 };
        (!self.has(FaultKind::OpenSsi, now)).then(|| Reading {
            revolutions: self.revolutions(now) + half_off,
            has_error: self.has(FaultKind::SsiError, now),
            is_disturbed: self.has(FaultKind::SsiParity, now),
        })
    }

    /// Whether a battery supplies VBAT.
    pub(crate) fn has_battery(&self, now: Time) -> bool {
        !self.has(FaultKind::BatteryEmpty, now)
    }

    /// Whether the backup SRAM loses some of its bits without the main supply.
    pub(crate) fn has_weak_battery(&self, now: Time) -> bool {
        self.has(FaultKind::BatteryWeak, now)
    }

    /// Whether OSC_IN has a clock.
    pub(crate) fn has_crystal(&self, now: Time) -> bool {
        !self.has(FaultKind::NoCrystal, now)
    }

    /// The next instant at which the clock on OSC_IN fails or returns.
    pub(crate) fn next_crystal_edge(&self, now: Time) -> Time {
        let faults = self.faults.iter().filter(|fault| fault.kind == FaultKind::NoCrystal);
        faults.map(|fault| fault.next_edge(now)).fold(Time::NEVER, Time::min)
    }

    /// The contacts that are closed.
    pub(crate) fn closed(&self, now: Time) -> [bool; BUTTONS] {
        self.buttons.map(|button| button.is_closed(now))
    }

    /// The next edge of the index up to `until`.
    pub(crate) fn next_index_edge(&self, now: Time, until: Time) -> Option<Time> {
        first_change(now, until, |at| self.shaft.index_edges(at))
    }

    fn has(&self, kind: FaultKind, now: Time) -> bool {
        self.faults.iter().any(|fault| fault.kind == kind && fault.is_active(now))
    }
}
