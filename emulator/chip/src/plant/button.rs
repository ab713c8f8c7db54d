//! Push buttons at digital inputs.

use std::str::FromStr;

use canbus::Time;
use thiserror::Error;

use crate::board::BUTTONS;

/// The time for which a contact bounces after a press or release, and the period of the bouncing.
const BOUNCES_FOR: Time = Time::from_micros(3000);
const BOUNCE: Time = Time::from_micros(700);

/// A push button with a mechanical contact.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Button {
    is_down: bool,
    since: Option<Time>,
}

impl Button {
    pub(super) fn set(&mut self, is_down: bool, now: Time) {
        if is_down != self.is_down {
            *self = Self { is_down, since: Some(now) };
        }
    }

    /// Whether the button is held down.
    pub(super) fn is_down(&self) -> bool {
        self.is_down
    }

    /// Whether the contact is closed.
    pub(super) fn is_closed(&self, now: Time) -> bool {
        let age = self.since.map(|since| now.since(since)).filter(|age| *age < BOUNCES_FOR);
        let bounced = age.is_some_and(|age| age.0 / (BOUNCE.0 / 2) % 2 == 1);
        self.is_down != bounced
    }
}

/// A press or a release of a button.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Push {
    /// The number of the button, from 0 on.
    pub button: usize,
    /// `true` for a press, after which the button is held.
    pub down: bool,
}

/// The reason why the text of a push is invalid. Every message is one line.
#[derive(Debug, Error, PartialEq, Eq)]
pub enum PushError {
    /// Not `NUMBER:down` or `NUMBER:up`.
    #[error("`{0}` is not of the form NUMBER:down or NUMBER:up, for example 1:down")]
    Form(String),
    /// No such button.
    #[error("there is no button `{0}`; the board has 1 and 2")]
    Button(String),
}

impl FromStr for Push {
    type Err = PushError;

    /// `NUMBER:down` or `NUMBER:up`; the numbers are those on the board, from 1 on.
    fn from_str(spec: &str) -> Result<Self, PushError> {
        let (number, down) = match spec.split_once(':') {
            Some((number, "down")) => (number, true),
            Some((number, "up")) => (number, false),
            _ => return Err(PushError::Form(spec.to_owned())),
        };
        let known = number.parse().ok().filter(|number| (1..=BUTTONS).contains(number));
        let number = known.ok_or_else(|| PushError::Button(number.to_owned()))?;
        Ok(Self { button: number - 1, down })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_contact_bounces_and_then_is_quiet() {
        let mut button = Button::default();
        button.set(true, Time::from_millis(10));
        let closed = |micros| button.is_closed(Time::from_micros(micros));
        assert!(closed(10_000), "it closes at once");
        assert!(!closed(10_400), "opens again");
        assert!(closed(10_800));
        assert!((13_000..20_000).all(closed));
    }

    #[test]
    fn a_press_of_a_pressed_button_changes_nothing() {
        let mut button = Button::default();
        button.set(false, Time::ZERO);
        assert!((0..5000).all(|micros| !button.is_closed(Time::from_micros(micros))));
    }

    #[test]
    fn mistakes_are_named_in_one_line() {
        assert_eq!("2:down".parse(), Ok(Push { button: 1, down: true }));
        assert_eq!("1:up".parse(), Ok(Push { button: 0, down: false }));
        let message = |spec: &str| spec.parse::<Push>().unwrap_err().to_string();
        assert_eq!(message("3:up"), "there is no button `3`; the board has 1 and 2");
        assert_eq!(message("0:up"), "there is no button `0`; the board has 1 and 2");
        for spec in ["1", "1:", "1:held"] {
            assert!(message(spec).starts_with(&format!("`{spec}` is not of the form")), "{spec}");
        }
    }
}
