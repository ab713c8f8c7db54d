//! Input and output panel units: a button and a lamp.
//!
//! Virtual inputs (6010h) and outputs (6011h) are words of 48 bits whose structure is not public. So the node does not
//! look into them: it sends one word while the button is pressed and another one while it is not, and it lights the lamp
//! on one word and puts it out on another. Every other word is for somebody else.

/// Milliseconds for which a contact must stay before it is believed.
const DEBOUNCE: u8 = 20;

/// A contact that bounces.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contact {
    is_closed: bool,
    /// Milliseconds for which it has been the other way.
    other: u8,
}

impl Contact {
    /// Takes the state of the pin, once a millisecond; returns that of the contact.
    pub fn sample(&mut self, is_closed: bool) -> bool {
        self.other = if is_closed == self.is_closed { 0 } else { self.other.saturating_add(1) };
        if self.other >= DEBOUNCE {
            *self = Contact { is_closed, other: 0 };
        }
        self.is_closed
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
    fn a_contact_that_bounces_is_one_contact() {
        let mut contact = Contact::default();
        assert!((0..100).all(|t| !contact.sample(t % 15 != 0)));
        let closed = (0..100).map(|_| contact.sample(true)).position(|is_closed| is_closed);
        assert_eq!(closed, Some(usize::from(DEBOUNCE) - 1 - 9), "nine of them were before");
        assert!(contact.sample(false));
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
