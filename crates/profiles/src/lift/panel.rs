//! Input and output panel units: two buttons and two lamps.
//!
//! Each change of a button is an event, and a call that is not sent is lost. Changes therefore wait here until the bus
//! takes them.

use crate::board::{DIGITAL_INPUTS, DIGITAL_OUTPUTS};
use heapless::Deque;

/// Buttons of a panel.
pub const BUTTONS: usize = DIGITAL_INPUTS;
/// Lamps of a panel.
pub const LAMPS: usize = DIGITAL_OUTPUTS;
/// Number of changes that can wait: a button pressed ten times a second fills the queue in more than a second.
const WAITING: usize = 32;

/// A button and its new state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Number of the button, from 0.
    pub button: u8,
    /// Whether it is pressed.
    pub is_pressed: bool,
}

/// Calls to be sent: changes of the buttons in their order, then the states that were asked for.
///
/// If the queue is full, the newest changes are dropped, and the states of all buttons follow after the waiting
/// changes.
#[derive(Debug, Default)]
pub struct Calls {
    pressed: [bool; BUTTONS],
    changes: Deque<Contact, WAITING>,
    /// A change was dropped.
    has_lost: bool,
    /// The buttons whose states are to be sent.
    asked: [bool; BUTTONS],
    /// The buttons that were last sent as pressed.
    told: [bool; BUTTONS],
}

impl Calls {
    /// Takes the debounced state of the buttons.
    pub fn observe(&mut self, pressed: [bool; BUTTONS]) {
        for (button, (before, now)) in (0..).zip(self.pressed.iter_mut().zip(pressed)) {
            if core::mem::replace(before, now) != now {
                let change = Contact { button, is_pressed: now };
                self.has_lost = self.has_lost || self.changes.push_back(change).is_err();
            }
        }
    }

    /// Forgets all changes; the states of all buttons are to be sent.
    pub fn begin(&mut self) {
        self.changes.clear();
        (self.has_lost, self.asked) = (false, [true; BUTTONS]);
    }

    /// Asks for the state of this button to be sent.
    pub fn ask(&mut self, button: usize) {
        if let Some(asked) = self.asked.get_mut(button) {
            *asked = true;
        }
    }

    /// Whether a contact is to be sent, of a button that `is_used`. A button that is no longer used is released once.
    pub(crate) fn tell(&mut self, contact: Contact, is_used: bool) -> bool {
        let Some(told) = self.told.get_mut(usize::from(contact.button)) else { return false };
        core::mem::replace(told, contact.is_pressed && is_used) || is_used
    }

    /// The next call to be sent.
    #[inline(never)]
    pub fn take_next(&mut self) -> Option<Contact> {
        if let Some(change) = self.changes.pop_front() {
            return Some(change);
        }
        if core::mem::take(&mut self.has_lost) {
            self.asked = [true; BUTTONS];
        }
        let states = (0..).zip(self.asked.iter_mut().zip(self.pressed));
        for (button, (asked, is_pressed)) in states {
            if core::mem::take(asked) {
                return Some(Contact { button, is_pressed });
            }
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contact(button: u8, is_pressed: bool) -> Contact {
        Contact { button, is_pressed }
    }

    fn all(calls: &mut Calls) -> Vec<Contact> {
        std::iter::from_fn(|| calls.take_next()).collect()
    }

    #[test]
    fn every_change_is_reported_in_its_order() {
        let mut calls = Calls::default();
        for pressed in [[true, false], [true, true], [true, true], [false, true], [false, false]] {
            calls.observe(pressed);
        }
        let expected = [contact(0, true), contact(1, true), contact(0, false), contact(1, false)];
        assert_eq!(all(&mut calls), expected);
    }

    #[test]
    fn states_follow_behind_changes() {
        let mut calls = Calls::default();
        calls.observe([true, false]);
        calls.ask(0);
        assert_eq!(all(&mut calls), [contact(0, true); 2]);
        calls.begin();
        assert_eq!(all(&mut calls), [contact(0, true), contact(1, false)]);
    }

    #[test]
    fn discarded_changes_are_covered_by_the_states() {
        let mut calls = Calls::default();
        for change in 0..WAITING + 3 {
            calls.observe([change % 2 == 0, false]);
        }
        let told = all(&mut calls);
        assert_eq!(told.len(), WAITING + BUTTONS);
        assert_eq!(told[WAITING..], [contact(0, true), contact(1, false)]);
        calls.observe([false, false]);
        assert_eq!(all(&mut calls), [contact(0, false)]);
    }
}
