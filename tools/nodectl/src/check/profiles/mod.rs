//! Checks of the mandatory objects of device profiles.
//!
//! The lists of objects come from public texts: CiA's product pages, manuals of certified devices, and the published
//! tables of objects. Where a profile has classes, the smallest class counts.

mod encoder;
mod io;
mod lift;
mod measuring;

use clap::ValueEnum;

use super::Check;
use super::prelude::{Outcome, Subject, ensure};

/// A device profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Profile {
    /// Generic I/O modules.
    #[value(name = "401")]
    Io,
    /// Measuring devices and closed-loop controllers.
    #[value(name = "404")]
    Measuring,
    /// Encoders.
    #[value(name = "406")]
    Encoder,
    /// Lift control.
    #[value(name = "417")]
    Lift,
}

impl Profile {
    /// The checks of the profile.
    #[must_use]
    pub(super) const fn checks(self) -> &'static [&'static [Check]] {
        match self {
            Profile::Io => &[io::CHECKS],
            Profile::Measuring => &[measuring::CHECKS],
            Profile::Encoder => &[encoder::CHECKS],
            Profile::Lift => &[lift::CHECKS],
        }
    }

    /// All profiles.
    pub const ALL: [Profile; 4] = [Profile::Io, Profile::Measuring, Profile::Encoder, Profile::Lift];
}

/// Checks that 1000h names the profile.
fn names<const NUMBER: u32>(s: &mut Subject<'_>) -> Outcome {
    let profile = s.number(0x1000, 0)? & 0xFFFF;
    ensure(profile == NUMBER, format!("{NUMBER} in the low word of 1000h"), format!("{profile}"))
}

/// Checks that the entry can be read and has this number of bytes.
fn has<const INDEX: u16, const SUB: u8, const BYTES: usize>(s: &mut Subject<'_>) -> Outcome {
    let bytes = s.read(INDEX, SUB)?;
    ensure(bytes.len() == BYTES, format!("{BYTES} bytes in {INDEX:04X}h:{SUB}"), format!("{bytes:02X?}"))
}

/// The first of these objects that exists in the device.
fn first_of(s: &mut Subject<'_>, places: &[(u16, u8)]) -> Outcome<Option<(u16, u8)>> {
    for place in places {
        if s.try_read(place.0, place.1)?.is_ok() {
            return Ok(Some(*place));
        }
    }
    Ok(None)
}

/// Checks that the device has one of these objects, and that a TPDO can carry it by the data sheet.
fn one_is_sent(s: &mut Subject<'_>, places: &[(u16, u8)], name: &str) -> Outcome {
    let there = first_of(s, places)?;
    ensure(there.is_some(), format!("{name} in one of {places:04X?}"), "in none")?;
    let sheet = s.sheet()?;
    let is_sent = places.iter().any(|at| sheet.get(at.0, at.1).is_some_and(eds::Entry::is_tpdo_mappable));
    ensure(is_sent, format!("{name} can be mapped into a TPDO"), "the data sheet says no")
}
