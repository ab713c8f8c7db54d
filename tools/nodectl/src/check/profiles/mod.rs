//! What device profiles make mandatory.
//!
//! The lists are those of the public texts: CiA's product pages, manuals of certified devices, and the published tables of objects.
//! Where a profile has classes, the smallest is taken.

mod encoder;
mod io;
mod lift;
mod measuring;

use clap::ValueEnum;

use super::Check;
use super::subject::prelude::{Outcome, Subject, ensure};

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
    /// Its checks.
    #[must_use]
    pub(super) const fn checks(self) -> &'static [&'static [Check]] {
        match self {
            Profile::Io => &[io::CHECKS],
            Profile::Measuring => &[measuring::CHECKS],
            Profile::Encoder => &[encoder::CHECKS],
            Profile::Lift => &[lift::CHECKS],
        }
    }

    /// All of them.
    pub const ALL: [Profile; 4] = [Profile::Io, Profile::Measuring, Profile::Encoder, Profile::Lift];
}

/// 1000h names the profile.
fn names<const NUMBER: u32>(s: &mut Subject<'_>) -> Outcome {
    let profile = s.number(0x1000, 0)? & 0xFFFF;
    ensure(profile == NUMBER, format!("{NUMBER} in the low word of 1000h"), format!("{profile}"))
}

/// The entry can be read, with so many bytes.
fn has<const INDEX: u16, const SUB: u8, const BYTES: usize>(s: &mut Subject<'_>) -> Outcome {
    let bytes = s.read(INDEX, SUB)?;
    ensure(bytes.len() == BYTES, format!("{BYTES} bytes in {INDEX:04X}h:{SUB}"), format!("{bytes:02X?}"))
}

/// The first of these objects that the device has.
fn first_of(s: &mut Subject<'_>, places: &[(u16, u8)]) -> Outcome<Option<(u16, u8)>> {
    for place in places {
        if s.try_read(place.0, place.1)?.is_ok() {
            return Ok(Some(*place));
        }
    }
    Ok(None)
}

/// Of these objects the device has one, and the data sheet says that a TPDO can carry it.
fn one_is_sent(s: &mut Subject<'_>, places: &[(u16, u8)], name: &str) -> Outcome {
    let there = first_of(s, places)?;
    ensure(there.is_some(), format!("{name} in one of {places:04X?}"), "in none")?;
    let sheet = s.sheet()?;
    let is_sent = places.iter().any(|at| sheet.get(at.0, at.1).is_some_and(eds::Entry::is_tpdo_mappable));
    ensure(is_sent, format!("{name} can be mapped into a TPDO"), "the data sheet says no")
}
