//! The trial of a new image: the previous image is kept until the new one is confirmed, and is restored if the new one
//! fails.
//!
//! The record of the kept image decides. While it is *pending*, the confirmed program is the kept one, and the program in
//! the application area is on trial. Only two things end that: a confirmation, which programs *done* there, and the
//! return, which does so after the copy of the kept image. The next update begins afterwards: until then staging holds
//! the image on trial and, in front of the commit record, the marks of the trial:
//!
//! | mark | set |
//! |---|---|
//! | 0 to 2 | at each unrequested start: after a crash, the watchdog, or power-on |
//! | 3 | when the trial is withdrawn: no confirmation in time, or the command of a master |
//!
//! The trial is lost with mark 3, or with all of the marks 0 to 2. From then on the staged image is never copied again,
//! and an application that is not whole is restored from the kept image, whatever the records read after a cut. Mark 3
//! is also set before the previous image is restored, so that marks which a cut left half programmed no longer matter.
//!
//! A mark is a word of zeros, like those of the record. The trial concerns one image only: an application that a debugger
//! has written since is not on trial, and its first start closes the record of the kept image.

use core::ops::Range;

use crate::area::{Area, Layout};
use crate::crashes::Crashes;
use crate::flash::Flash;
use crate::header::{HEADER, Header};
use crate::record::{Commit, RECORD_ROOM, Record, is_zero, mark};
use crate::refusal::Refusal;

/// Room for a mark: a word of any size.
const ROOM: u32 = 8;
/// Number of unrequested starts that lose the trial.
const STRIKES: u32 = Crashes::LIMIT as u32;
/// Number of the mark for a withdrawn trial.
const WITHDRAWN: u32 = STRIKES;

/// State of the application's trial.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Trial {
    /// No trial: the application was confirmed, or there is no image to restore.
    #[default]
    None,
    /// The new image is being copied, and the previous one is kept.
    Begun,
    /// The application has to be confirmed.
    Open,
    /// The previous image has to be restored.
    Lost(Reason),
    /// The previous image has been restored.
    Over(Reason),
}

/// Why a trial was lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reason {
    /// Three unrequested starts without a confirmation.
    Starts,
    /// No confirmation in time, or the command of a master.
    Withdrawn,
}

impl Trial {
    /// Reads the state of the trial.
    pub fn read<F: Flash>(flash: &mut F, layout: &Layout) -> Trial {
        let (staged, kept) = (staged(layout).read(flash), kept(layout).read(flash));
        match (staged, kept, reason(flash, layout)) {
            // In this state the application may be half copied.
            (_, Commit::Pending, Some(reason)) => Trial::Lost(reason),
            (_, Commit::Done, Some(reason)) if !is_another(flash, layout, layout.kept()) => {
                Trial::Over(reason)
            }
            (Commit::Pending, Commit::Pending, None) => Trial::Begun,
            (Commit::Done, Commit::Pending, None) if !is_another(flash, layout, layout.staging()) => {
                Trial::Open
            }
            _ => Trial::None,
        }
    }

    /// The ranges of the marks and records that a trial reads and programs, as offsets.
    #[must_use]
    pub fn records(layout: &Layout) -> [Range<u32>; 2] {
        [layout.staging().end(), layout.kept().end()].map(|end| end.saturating_sub(RECORD_ROOM)..end)
    }

    /// Confirms the application. Repeated calls do no harm.
    ///
    /// # Errors
    /// [`Refusal::Write`]; [`Refusal::Unspecified`] if the trial is lost.
    pub fn confirm<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
        if reason(flash, layout).is_some() {
            return Err(Refusal::Unspecified);
        }
        // A cut may have left a mark that reads as set now and not later: the image would be copied once more.
        if staged(layout).read(flash) == Commit::Done {
            staged(layout).done(flash)?;
        }
        kept(layout).done(flash)
    }

    /// Withdraws the trial: the previous image is restored at the next start. Does nothing to a confirmed application.
    ///
    /// # Errors
    /// [`Refusal::Write`], [`Refusal::Unspecified`].
    pub fn withdraw<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
        if kept(layout).read(flash) == Commit::Pending { fail(flash, layout) } else { Ok(()) }
    }

    /// Whether the trial was lost: the staged image is not copied again, and the kept one is the right program.
    pub(crate) fn has_failed(self) -> bool {
        matches!(self, Trial::Lost(_) | Trial::Over(_))
    }

    /// Whether the application is or may be on trial: neither it nor the kept image is confirmed for good.
    pub(crate) fn is_undecided(self) -> bool {
        matches!(self, Trial::Begun | Trial::Open | Trial::Lost(_))
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

/// Closes the record of a kept image that is pending without a trial.
pub(crate) fn close<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
    let record = kept(layout);
    if record.read(flash) == Commit::Pending { record.done(flash) } else { Ok(()) }
}

/// Loses the trial for good, before the application is touched.
pub(crate) fn fail<F: Flash>(flash: &mut F, layout: &Layout) -> Result<(), Refusal> {
    mark(flash, place(layout, WITHDRAWN))
}

/// Whether the application has a header, but not that of the image in `area`. Without a header it is damaged, or half
/// copied.
pub(crate) fn is_another<F: Flash>(flash: &mut F, layout: &Layout, area: Area) -> bool {
    let mut crc = [0; 4];
    let is_read = flash.read(area.start().saturating_add(HEADER - 4), &mut crc).is_ok();
    let mut header = Header::EMPTY;
    let is_whole = header.read(flash, layout.application()).is_ok();
    is_read && is_whole && header.crc() != u32::from_le_bytes(crc)
}

/// Counts an unrequested start.
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

/// Number of consecutive marks that are set, from the first on.
fn strikes<F: Flash>(flash: &mut F, layout: &Layout) -> u32 {
    let is_open = |number: &u32| !is_set(flash, layout, *number);
    (0..STRIKES).find(is_open).unwrap_or(STRIKES)
}

fn is_set<F: Flash>(flash: &mut F, layout: &Layout, number: u32) -> bool {
    is_zero(flash, place(layout, number), u8::MAX)
}

fn place(layout: &Layout, number: u32) -> u32 {
    let first = layout.staging().end().saturating_sub(RECORD_ROOM);
    first.saturating_add(number.saturating_mul(ROOM))
}
