//! The units of the columns. A column has one unit; the unit of a signal may change.

use crate::acquisition::Signal;
use crate::object::Place;
use crate::text::{note, visible};

/// The unit of each column, and the present unit of its signal.
pub(super) struct Units(Vec<(String, String)>);

impl Units {
    pub(super) fn new(signals: &[Signal]) -> Units {
        Units(signals.iter().map(|signal| (signal.unit.clone(), signal.unit.clone())).collect())
    }

    /// Whether a value of a signal has the unit of its column. A change is printed.
    pub(super) fn fit(&mut self, column: usize, signal: &Signal) -> bool {
        let Some((unit, present)) = self.0.get_mut(column) else { return false };
        if *present != signal.unit {
            present.clone_from(&signal.unit);
            note(visible(&words(signal, unit)));
        }
        signal.unit == *unit
    }
}

fn words(signal: &Signal, unit: &str) -> String {
    let place = Place(signal.at);
    let named = |unit: &str| if unit.is_empty() { "no unit".to_owned() } else { unit.to_owned() };
    let (unit, present) = (named(unit), named(&signal.unit));
    if unit == present {
        format!("{place} has the unit of its column again: {unit}")
    } else {
        format!("{place} has another unit now: {present}; its column is in {unit} and stays empty until then")
    }
}
