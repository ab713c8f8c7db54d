//! The programs in the areas of an update, for an object of the application.

use crate::area::{Area, Layout};
use crate::clears::Clears;
use crate::flash::Flash;
use crate::header::Header;
use crate::security::Security;
use crate::wear;

/// The programs of a node. A number is 0 where the flash does not tell it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Programs {
    /// The lowest security counter that an image may have.
    pub counter: u32,
    /// The lowest generation of keys that an image may have.
    pub generation: u32,
    /// Identification of the newest downloaded program: the program on trial, or the one that was rolled back.
    pub staged: u32,
    /// Identification of the program that was kept before the last update.
    pub kept: u32,
    /// Number of erases of the application area, staging and the area of the kept image together.
    pub erases: u16,
    /// Number of clears that the bootloader accepts now.
    pub clears_allowed: u8,
}

/// No programs, and the budget of clears after power-on.
impl Default for Programs {
    fn default() -> Programs {
        let clears_allowed = Clears::default().left();
        Programs { counter: 0, generation: 0, staged: 0, kept: 0, erases: 0, clears_allowed }
    }
}

impl Programs {
    /// Reads the areas.
    pub fn read<F: Flash>(flash: &mut F, layout: &Layout, clears: Clears) -> Programs {
        let security = Security(layout.security());
        Programs {
            counter: security.least_counter(flash),
            generation: security.least_generation(flash),
            staged: identification(flash, layout.staging()),
            kept: identification(flash, layout.kept()),
            erases: u16::try_from(wear::erases(flash, layout)).unwrap_or(u16::MAX),
            clears_allowed: clears.left(),
        }
    }
}

/// The identification of the image in an area.
#[inline(never)]
fn identification<F: Flash>(flash: &mut F, area: Area) -> u32 {
    let mut header = Header::EMPTY;
    header.read(flash, area).map_or(0, |()| header.code_crc())
}
