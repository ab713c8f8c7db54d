//! Input and output panel units: two buttons and two lamps.
//!
//! Virtual inputs (6010h) and outputs (6011h) are words of 48 bits whose structure is not public. So the node does not
//! look into them: each button has one word for when it is pressed and another one for when it is released, each lamp one
//! that lights it and another one that puts it out. Every other word is for somebody else.

use crate::board::{DIGITAL_INPUTS, DIGITAL_OUTPUTS};

/// Buttons of a panel.
pub const BUTTONS: usize = DIGITAL_INPUTS;
/// Lamps of a panel.
pub const LAMPS: usize = DIGITAL_OUTPUTS;

/// A button and what has happened to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Contact {
    /// Which one, from 0.
    pub button: usize,
    /// Whether it is pressed.
    pub is_pressed: bool,
}

/// The buttons. The virtual input says one thing at a time: of buttons that change in the same millisecond, the second is
/// told in the next.
#[derive(Clone, Copy, Debug, Default)]
pub struct Buttons {
    told: [bool; BUTTONS],
    last: Contact,
}

impl Buttons {
    /// Takes which buttons are pressed, once a millisecond and debounced; returns the last change.
    pub fn sample(&mut self, pressed: [bool; BUTTONS]) -> Contact {
        let changed = (0..).zip(self.told.iter_mut().zip(pressed)).find(|(_, (told, now))| **told != *now);
        if let Some((button, (told, is_pressed))) = changed {
            *told = is_pressed;
            self.last = Contact { button, is_pressed };
        }
        self.last
    }
}

/// Listens to virtual outputs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Lamp {
    last: [u8; 6],
}

impl Lamp {
    /// What a virtual output does to the lamp when it is another one than before: lights it, puts it out, or nothing. Two
    /// equal words are for no lamp.
    pub fn follow(&mut self, output: [u8; 6], on: [u8; 6], off: [u8; 6]) -> Option<bool> {
        if core::mem::replace(&mut self.last, output) == output {
            return None;
        }
        match (output == on, output == off) {
            (true, false) => Some(true),
            (false, true) => Some(false),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn buttons_are_told_one_after_the_other() {
        let contact = |button, is_pressed| Contact { button, is_pressed };
        let mut buttons = Buttons::default();
        let pressed =
            [[false, false], [true, true], [true, true], [true, true], [false, true], [false, false]];
        let told = pressed.map(|pressed| buttons.sample(pressed));
        let expected = [
            contact(0, false),
            contact(0, true),
            contact(1, true),
            contact(1, true),
            contact(0, false),
            contact(1, false),
        ];
        assert_eq!(told, expected);
    }

    #[test]
    fn a_lamp_follows_its_own_words() {
        let (on, off) = ([1, 2, 3, 4, 5, 6], [1, 2, 3, 4, 5, 7]);
        let mut lamp = Lamp::default();
        let followed = [on, on, off, [0; 6], on].map(|output| lamp.follow(output, on, off));
        assert_eq!(followed, [Some(true), None, Some(false), None, Some(true)]);
        assert_eq!(lamp.follow(off, off, off), None);
    }
}
