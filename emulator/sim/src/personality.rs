//! The personality of a node: the number that selects its dictionary.

use std::fmt;
use std::str::FromStr;

use serde::Serialize;

/// The personalities of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Personality {
    /// Pressure and temperature transmitter (CiA 404).
    Pressure,
    /// Encoder (CiA 406).
    Encoder,
    /// Both, as a module of two devices.
    Combined,
    /// Units of a lift (CiA 417).
    Lift,
}

impl Personality {
    /// All personalities of the firmware.
    const ALL: [Personality; 4] =
        [Personality::Pressure, Personality::Encoder, Personality::Combined, Personality::Lift];

    /// The number in the device record.
    pub fn number(self) -> u8 {
        match self {
            Personality::Pressure => 0,
            Personality::Encoder => 1,
            Personality::Combined => 2,
            Personality::Lift => 3,
        }
    }
}

impl fmt::Display for Personality {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Personality::Pressure => "pressure",
            Personality::Encoder => "encoder",
            Personality::Combined => "combined",
            Personality::Lift => "lift",
        })
    }
}

impl FromStr for Personality {
    type Err = String;

    fn from_str(text: &str) -> Result<Personality, String> {
        let known = Personality::ALL.into_iter().find(|known| known.to_string() == text);
        known.ok_or_else(|| {
            let names: Vec<String> = Personality::ALL.iter().map(ToString::to_string).collect();
            format!("the firmware has no personality {text:?}; it has: {}", names.join(", "))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_written_name_reads_back() {
        for personality in Personality::ALL {
            assert_eq!(personality.to_string().parse(), Ok(personality));
        }
        assert!(
            "valve".parse::<Personality>().unwrap_err().contains("it has: pressure, encoder, combined, lift")
        );
    }
}
