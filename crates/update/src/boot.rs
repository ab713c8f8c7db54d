//! What to do at a start.

use crate::crashes::{Crashes, Reset};
use crate::flash::Flash;
use crate::header::Header;
use crate::image::{self, FullCheck};
use crate::record::Commit;
use crate::refusal::Refusal;
use crate::status::Status;
use crate::target::Target;
use crate::trial::{self, Trial};

/// What a start has to go by besides the flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// The application was told to enter the bootloader (1F51h = 0 or 2).
    pub stay: bool,
    /// Why the chip was reset.
    pub reset: Reset,
    /// The crashes of the application, this reset counted.
    pub crashes: Crashes,
    /// How far the signature of the application is proven.
    pub proof: Proof,
}

/// How far the signature of the application is proven since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// Nothing, as after power-on: it is checked.
    #[default]
    None,
    /// The signature of the image whose header has this CRC was found good since power-on: for that image the CRC of the code is
    /// enough. The number is the word that [`boot_sealed`] left at that start.
    Of(u32),
    /// It does not matter now, as another start will decide.
    Waived,
}

/// What to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decision {
    /// Start the application; this is its header.
    Start(Header),
    /// A checked image waits in staging: [`crate::Updater::install`], then ask again. If the answer is the same then, the
    /// copy has failed; stay with what [`crate::Updater::status`] says.
    Copy,
    /// The trial of the application is lost: [`crate::Updater::revert`], then ask again.
    Revert,
    /// Stay in the bootloader.
    Stay(Stay),
}

/// Why the bootloader stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stay {
    /// It was asked to.
    Asked,
    /// There is no application that may be started, for this reason.
    NoProgram(Refusal),
    /// The application has crashed so often.
    Crashes(u8),
}

impl Stay {
    /// What 1F57h reads until an update begins.
    #[must_use]
    pub fn status(self) -> Status {
        match self {
            Stay::Asked => Status::GOOD,
            Stay::NoProgram(Refusal::Signature) => Status::refused(Refusal::Signature),
            Stay::NoProgram(_) => Status::refused(Refusal::NoProgram),
            Stay::Crashes(count) => Status::refused(Refusal::Crashes { count }),
        }
    }
}

/// Decides at every start. It reads the application once for its CRC and, without a [`Proof`], for its signature, so the clock
/// should be fast by then: whoever has put an application there, and whatever has become of it since, only one that is signed
/// starts. It writes where a commit was cut: a record that may read
/// otherwise next time is revoked, so what this start decides holds for good. It counts the starts of an application on trial that
/// nobody asked for. And it keeps the security counter of an application that is found to be signed and is not on trial, and the
/// keys that this application revokes.
///
/// `flash` must not be busy.
pub fn boot<F: Flash>(flash: &mut F, target: &Target, start: Start) -> Decision {
    boot_sealed(flash, target, start, &mut 0)
}

/// The same, with a word that is the CRC of the application's header when its signature is or was found good, by other means than
/// the decision; what the word was before is lost. To start the application without this word is not allowed: see crate bsp.
pub fn boot_sealed<F: Flash>(flash: &mut F, target: &Target, start: Start, seal: &mut u32) -> Decision {
    let commit = commit(flash, target);
    let trial = trial(flash, target, start);
    let is_on_trial = matches!(trial, Trial::Open | Trial::Lost(_));
    let crashes = start.crashes.count();
    if !is_on_trial {
        note_proven(flash, target, start.proof);
    }
    if commit == Commit::Pending {
        return Decision::Copy;
    }
    if let Trial::Lost(_) = trial {
        return Decision::Revert;
    }
    if start.stay {
        return Decision::Stay(Stay::Asked);
    }
    if crashes >= Crashes::LIMIT {
        return Decision::Stay(Stay::Crashes(crashes));
    }
    match sealed(flash, target, start.proof, seal) {
        Ok(header) => {
            if start.proof != Proof::Waived && !is_on_trial {
                note(flash, target, &header);
            }
            Decision::Start(header)
        }
        // The mark that the copy is done may have been cut, read as not programmed, and the copy begun again. Now it
        // reads as programmed, but the image that it speaks of is still in staging.
        Err(_) if commit == Commit::Done => Decision::Copy,
        Err(refusal) => Decision::Stay(Stay::NoProgram(refusal)),
    }
}

/// What the commit record says, after a torn one was revoked.
fn commit<F: Flash>(flash: &mut F, target: &Target) -> Commit {
    let record = trial::staged(&target.layout);
    let commit = record.read(flash);
    if commit == Commit::Torn {
        // Should it fail, the next start tries again.
        let _ = record.revoke(flash);
    }
    commit
}

/// How the trial stands, after this start was counted.
fn trial<F: Flash>(flash: &mut F, target: &Target, start: Start) -> Trial {
    let is_counted = start.reset != Reset::Asked && start.proof != Proof::Waived;
    if is_counted && Trial::read(flash, &target.layout) == Trial::Open {
        // Should it fail, the next start tries again.
        let _ = trial::strike(flash, &target.layout);
    }
    Trial::read(flash, &target.layout)
}

/// The application whose signature was found good since power-on has run, and may be about to be replaced.
fn note_proven<F: Flash>(flash: &mut F, target: &Target, proof: Proof) {
    if let Ok(header) = image::header(flash, target.layout.application())
        && proof == Proof::Of(header.crc())
    {
        note(flash, target, &header);
    }
}

/// Nothing older than this application runs from now on.
fn note<F: Flash>(flash: &mut F, target: &Target, header: &Header) {
    // Should it fail, the next start tries again.
    let _ = target.security().note(flash, header);
}

/// The header of the application, when all of it is there, it is one of this node, and its signature is or was found good.
///
/// # Errors
/// Why it may not be started.
pub fn application<F: Flash>(flash: &mut F, target: &Target, proof: Proof) -> Result<Header, Refusal> {
    sealed(flash, target, proof, &mut 0)
}

fn sealed<F: Flash>(flash: &mut F, target: &Target, proof: Proof, seal: &mut u32) -> Result<Header, Refusal> {
    let area = target.layout.application();
    let header = image::admitted(flash, target, area)?;
    let is_proven = proof == Proof::Waived || proof == Proof::Of(header.crc());
    let mut check = if is_proven { FullCheck::of_sum(header, area) } else { FullCheck::of(header, area) };
    loop {
        if let Some(header) = check.step(flash, target)? {
            *seal = if let Proof::Of(word) = proof { word } else { 0 };
            if !is_proven {
                *seal = check.seal(target);
            }
            return Ok(header);
        }
    }
}
