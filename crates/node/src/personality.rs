//! Which device the node is.

use crate::{combined, encoder, flags, lift, pressure};
use canopen::dictionary::Dictionary;

/// Which device the node is: its dictionary, its default parameters and its profile.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Personality {
    /// Pressure and temperature transmitter, CiA 404.
    #[default]
    Pressure,
    /// Encoder, CiA 406.
    Encoder,
    /// Both, as a module of two devices (CiA 301, 7.5.2.1).
    Combined,
    /// Car position, load measuring and panel units of a lift, CiA 417.
    Lift,
}

/// What a personality is made of.
pub(crate) struct Definition {
    pub(crate) dictionary: &'static Dictionary,
    /// Where the values are of what it has; `None` for what it has not.
    pub(crate) flags: Option<&'static flags::Fields>,
    pub(crate) pressure: Option<&'static pressure::Fields>,
    pub(crate) encoder: Option<&'static encoder::Fields>,
    pub(crate) lift: Option<&'static lift::Fields>,
}

impl Definition {
    /// Whether the dictionary has the calibration of the pressure channel.
    pub(crate) const fn is_calibrated(&self) -> bool {
        self.pressure.is_some() || self.lift.is_some()
    }
}

impl Personality {
    /// All of them, in the order of their numbers.
    pub const ALL: [Personality; 4] =
        [Personality::Pressure, Personality::Encoder, Personality::Combined, Personality::Lift];

    /// The personality of a number in the device record; `None` for one that this image does not have.
    #[must_use]
    pub const fn numbered(number: u8) -> Option<Personality> {
        match number {
            0 => Some(Personality::Pressure),
            1 => Some(Personality::Encoder),
            2 => Some(Personality::Combined),
            3 => Some(Personality::Lift),
            _ => None,
        }
    }

    /// Its number in the device record and in object 2000h.
    #[must_use]
    pub const fn number(self) -> u8 {
        match self {
            Personality::Pressure => 0,
            Personality::Encoder => 1,
            Personality::Combined => 2,
            Personality::Lift => 3,
        }
    }

    /// Product code of object 1018h:2.
    #[must_use]
    pub const fn product_code(self) -> u32 {
        match self {
            Personality::Pressure => 1,
            Personality::Encoder => 2,
            Personality::Combined => 3,
            Personality::Lift => 4,
        }
    }

    pub(crate) const fn definition(self) -> &'static Definition {
        match self {
            Personality::Pressure => &pressure::DEFINITION,
            Personality::Encoder => &encoder::DEFINITION,
            Personality::Combined => &combined::DEFINITION,
            Personality::Lift => &lift::DEFINITION,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_places_in_the_list() {
        for (place, personality) in (0..).zip(Personality::ALL) {
            assert_eq!((personality.number(), Personality::numbered(place)), (place, Some(personality)));
        }
        assert_eq!(Personality::numbered(Personality::ALL.len().try_into().unwrap()), None);
    }
}
