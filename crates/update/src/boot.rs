//! The decision at each start: run the application, copy an image, or stay in the bootloader.

use crate::crashes::{Crashes, Reset};
use crate::flash::Flash;
use crate::header::Header;
use crate::image::{self, FullCheck};
use crate::record::Commit;
use crate::refusal::Refusal;
use crate::status::Status;
use crate::target::Target;
use crate::trial::{self, Trial};

/// Inputs of the decision besides the flash.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Start {
    /// A master has sent the application into the bootloader (1F51h = 0 or 2).
    pub stay: bool,
    /// Why the chip was reset.
    pub reset: Reset,
    /// Number of crashes of the application, this reset included.
    pub crashes: Crashes,
    /// How far the signature of the application is proven.
    pub proof: Proof,
}

/// How far the signature of the application has been verified since power-on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Proof {
    /// Not verified, for example after power-on: the signature must be verified now.
    #[default]
    None,
    /// The signature of the image whose header has this CRC was verified since power-on, so for this image the CRC of
    /// the code is enough. The number is the word that [`boot_sealed`] left at that start.
    Of(u32),
    /// Not needed now, because another start will decide.
    Waived,
}

/// The result of the decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[expect(clippy::large_enum_variant, reason = "there is one decision, and no heap")]
pub enum Decision {
    /// Start the application; this is its header.
    Start(Header),
    /// A checked image waits in staging: call [`crate::Updater::install`], then ask again. If the answer is the same
    /// again, the copy has failed: stay with [`crate::Updater::status`].
    Copy,
    /// The application has lost its trial, or has not been restored completely: call [`crate::Updater::revert`], then ask again.
    Revert,
    /// Stay in the bootloader.
    Stay(Stay),
}

/// Why the bootloader stays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stay {
    /// On request.
    Asked,
    /// There is no application that may be started, for this reason.
    NoProgram(Refusal),
    /// The application has crashed this many times.
    Crashes(u8),
}

impl Stay {
    /// Value of 1F57h until an update begins.
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

/// Decides at every start. Reads the application once for its CRC and, without a [`Proof`], for its signature, so the
/// clock should be fast before the call. Only a signed application is started, no matter how it got there.
///
/// Writes to the flash in these cases. A record that was cut and may read differently next time is revoked, so that the
/// decision of this start is final. Unrequested starts of an application on trial are counted. For a signed application
/// that is not on trial, its security counter and the generation of its keys are recorded.
///
/// `flash` must not be busy.
pub fn boot<F: Flash>(flash: &mut F, target: &Target, start: Start) -> Decision {
    boot_sealed(flash, target, start, &mut 0)
}

/// Like [`boot`], with a word that becomes the CRC of the application's header if its signature is or was verified,
/// independently of the decision; the previous content of the word is lost. The application must not be started without
/// this word: see crate bsp.
pub fn boot_sealed<F: Flash>(flash: &mut F, target: &Target, start: Start, seal: &mut u32) -> Decision {
    let commit = commit(flash, target);
    let trial = trial(flash, target, start);
    let is_on_trial = trial.is_undecided();
    let crashes = start.crashes.count();
    if !is_on_trial {
        note_proven(flash, target, start.proof);
    }
    if let Trial::Lost(_) = trial {
        return Decision::Revert;
    }
    if commit == Commit::Pending && !trial.has_failed() {
        return Decision::Copy;
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
        // A cut at the end of the return may have repeated it.
        Err(_) if trial.has_failed() => Decision::Revert,
        // A cut while the copy was marked as done may have left a mark that read as not programmed, so the copy began
        // again. Now the mark reads as programmed, but its image is still in staging.
        Err(_) if commit == Commit::Done => Decision::Copy,
        Err(refusal) => Decision::Stay(Stay::NoProgram(refusal)),
    }
}

/// The state of the commit record, after an incomplete record was revoked.
fn commit<F: Flash>(flash: &mut F, target: &Target) -> Commit {
    let record = trial::staged(&target.layout);
    let commit = record.read(flash);
    if commit == Commit::Torn {
        // If this fails, the next start tries again.
        let _ = record.revoke(flash);
    }
    commit
}

/// The state of the trial, after this start was counted.
fn trial<F: Flash>(flash: &mut F, target: &Target, start: Start) -> Trial {
    let is_counted = start.reset != Reset::Asked && start.proof != Proof::Waived;
    if is_counted && Trial::read(flash, &target.layout) == Trial::Open {
        // If this fails, the next start tries again.
        let _ = trial::strike(flash, &target.layout);
    }
    Trial::read(flash, &target.layout)
}

/// Records counter and key generation of the application whose signature was verified since power-on: it has run, and may
/// be about to be replaced.
fn note_proven<F: Flash>(flash: &mut F, target: &Target, proof: Proof) {
    let mut header = Header::EMPTY;
    let is_whole = header.read(flash, target.layout.application()).is_ok();
    if is_whole && proof == Proof::Of(header.crc()) {
        note(flash, target, &header);
    }
}

/// Records that nothing older than this application, which is confirmed, may run from now on.
fn note<F: Flash>(flash: &mut F, target: &Target, header: &Header) {
    // If this fails, the next start tries again.
    let _ = trial::close(flash, &target.layout).and_then(|()| target.security().note(flash, header));
}

/// The header of the application, if the application is complete, is for this node, and its signature is or was
/// verified.
///
/// # Errors
/// The reason why the application may not be started.
pub fn application<F: Flash>(flash: &mut F, target: &Target, proof: Proof) -> Result<Header, Refusal> {
    sealed(flash, target, proof, &mut 0)
}

fn sealed<F: Flash>(flash: &mut F, target: &Target, proof: Proof, seal: &mut u32) -> Result<Header, Refusal> {
    let area = target.layout.application();
    let mut header = Header::EMPTY;
    image::admitted(flash, target, area, &mut header)?;
    let is_proven = proof == Proof::Waived || proof == Proof::Of(header.crc());
    let mut check = FullCheck::of(&header, area, !is_proven);
    while !check.step(flash, target)? {}
    *seal = if let Proof::Of(word) = proof { word } else { 0 };
    if !is_proven {
        *seal = check.seal();
    }
    Ok(header)
}
