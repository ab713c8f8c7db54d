//! The trial of a new image: the image that ran before it is kept until the new one is confirmed, and comes back when the new one
//! fails.
//!
//! The trial is open from the end of the copy (the commit record of staging says *done*) for as long as the record of the kept
//! image says *pending*; to confirm is to program *done* there. In front of the commit record of staging are the marks of
//! the trial, which an update erases with staging:
//!
//! | mark | it is set |
//! |---|---|
//! | 0 to 2 | at each start that nobody asked for: after a crash, the watchdog, or power-on |
//! | 3 | the trial is withdrawn: nobody has confirmed the image in time, or a master wants the one before. Also when the way back begins: marks that a cut left half programmed decide nothing any more |
//!
//! With mark 3, or with 0 to 2, the trial is lost. A mark is a word of zeros, as those of the record. The trial is that of one image: of
//! an application that a debugger has put there since, nothing is said.

use core::ops::Range;

use crate::area::{Area, Layout};
use crate::crashes::Crashes;
use crate::flash::Flash;
use crate::header::HEADER;
use crate::record::{Commit, RECORD_ROOM, Record, is_zero, mark};
use crate::refusal::Refusal;

/// Room of a mark: a word of whatever size.
const ROOM: u32 = 8;
/// So many starts that nobody asked for lose the trial.
const STRIKES: u32 = Crashes::LIMIT as u32;
/// The mark that the trial is withdrawn.
const WITHDRAWN: u32 = STRIKES;

/// How the trial of the application stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trial {
    /// There is none: the application was confirmed, or nothing could have come back.
    #[default]
    None,
    /// The application is to be confirmed.
    Open,
    /// The image before is to come back.
    Lost(Reason),
    /// The image before is back.
    Over(Reason),
}

/// Why a trial was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Three starts that nobody asked for, and no confirmation.
    Starts,
    /// No confirmation in time, or the command of a master.
    Withdrawn,
}

impl Trial {
    /// Reads how the trial stands.
    pub fn read<F: Flash>(flash: &mut F, layout: &Layout) -> Trial {
        let (staged, kept) = (staged(layout).read(flash), kept(layout).read(flash));
        let image = if staged == Commit::None { layout.kept() } else { layout.staging() };
        let is_in_place = crc(flash, layout.application()) == crc(flash, image);
        match (staged, kept, reason(flash, layout)) {
            // The application may be half copied then.
            (Commit::Done, Commit::Pending, Some(reason)) => Trial::Lost(reason),
            (Commit::Done, Commit::Pending, None) if is_in_place => Trial::Open,
            (Commit::None, _, Some(reason)) if is_in_place => Trial::Over(reason),
            _ => Trial::None,
        }
    }

    /// Where the marks and records are that a trial reads and programs, as offsets.
    #[must_use]
    pub fn records(layout: &Layout) -> [Range<u32>; 2] {
        [layout.staging().end(), layout.kept().end()].map(|end| end.saturating_sub(RECORD_ROOM)..end)
    }

    /// The application is confirmed. To do so again does no harm.
    ///
    /// # Errors
    /// [`Refusal::Write`], [`Refusal::Unspecified`].
    pub fn confirm<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
        kept(layout).done(flash)
    }

    /// The image before is to come back at the next start.
    ///
    /// # Errors
    /// [`Refusal::Write`], [`Refusal::Unspecified`].
    pub fn withdraw<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
        mark(flash, place(layout, WITHDRAWN))
    }
}

/// The record of staging.
pub(crate) fn staged(layout: &Layout) -> Record {
    Record(layout.staging().end())
}

/// The record of the kept image.
pub(crate) fn kept(layout: &Layout) -> Record {
    Record(layout.kept().end())
}

/// The CRC of the header in this area, by which an image is known. A flash that cannot be read has none.
fn crc<F: Flash>(flash: &mut F, area: Area) -> [u8; 4] {
    let mut crc = [0; 4];
    let _ = flash.read(area.start().saturating_add(HEADER - 4), &mut crc);
    crc
}

/// A start that nobody asked for.
pub(crate) fn strike<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
    let next = strikes(flash, layout).min(STRIKES - 1);
    mark(flash, place(layout, next))
}

fn reason<F: Flash>(flash: &mut F, layout: &Layout) -> Option<Reason> {
    if strikes(flash, layout) == STRIKES {
        Some(Reason::Starts)
    } else if is_set(flash, layout, WITHDRAWN) {
        Some(Reason::Withdrawn)
    } else {
        None
    }
}

/// The marks from the first on that are set.
fn strikes<F: Flash>(flash: &mut F, layout: &Layout) -> u32 {
    let is_open = |number: &u32| !is_set(flash, layout, *number);
    (0..STRIKES).find(is_open).unwrap_or(STRIKES)
}

fn is_set<F: Flash>(flash: &mut F, layout: &Layout, number: u32) -> bool {
    is_zero(flash, place(layout, number)).unwrap_or(false)
}

fn place(layout: &Layout, number: u32) -> u32 {
    let first = layout.staging().end().saturating_sub(RECORD_ROOM);
    first.saturating_add(number.saturating_mul(ROOM))
}
