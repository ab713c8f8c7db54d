//! Field update of the application over CAN (CiA 302-3), safe against a power cut at any moment, and against images
//! that are damaged, for another board, too old, or not signed. docs/update.md describes the format of an image, the
//! states, and the effect of a cut at each point.
//!
//! The bootloader calls [`boot`] at every start, and gives an [`Updater`] the commands of the master and a [`Flash`]:
//!
//! ```
//! use update::{Decision, Flash, Header, Next, Start, Status, Stay, Target, Updater, boot};
//!
//! /// The decision at a start: the application to be started, or the value of 1F57h while the bootloader stays.
//! fn decide<F: Flash>(flash: &mut F, target: Target, start: Start) -> Result<Header, Status> {
//!     let decision = boot(flash, &target, start);
//!     if matches!(decision, Decision::Copy | Decision::Revert) {
//!         let mut updater = Updater::new(&mut *flash, target, Status::GOOD);
//!         // A refusal shows in the status.
//!         let _ = if decision == Decision::Copy { updater.install() } else { updater.revert() };
//!         while updater.poll() != Next::Nothing { /* serve the bus */ }
//!         if updater.status() != Status::GOOD {
//!             return Err(updater.status());
//!         }
//!     }
//!     match boot(flash, &target, start) {
//!         Decision::Start(header) => Ok(header),
//!         Decision::Stay(stay) => Err(stay.status()),
//!         Decision::Copy | Decision::Revert => Err(Stay::Asked.status()),
//!     }
//! }
//! ```
//!
//! | from the bus | call | 1F57h until the next |
//! |---|---|---|
//! | 1F51h = 3 | [`Updater::clear`], then [`Updater::poll`] | busy, then 0 |
//! | download to 1F50h begins | [`Updater::begin`] | 0, or 4 without a clear before |
//! | bytes of the download | [`Updater::receive`] | 0, or the refusal of the header |
//! | end of the download | [`Updater::finish`], then [`Updater::poll`] | busy during the check, then 0 or the refusal |
//! | 1F51h = 1, or at once | [`Updater::install`], [`Updater::poll`], then [`boot`] | busy during the copy, then 0 |
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
#![cfg_attr(
    not(any(test, feature = "mock")),
    warn(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic
    )
)]

#[cfg(any(test, feature = "mock"))]
extern crate std;

mod area;
mod authorisation;
mod boot;
mod certificate;
mod clears;
mod copy;
mod crashes;
mod download;
mod erase;
mod flash;
mod header;
mod image;
pub mod key;
mod log;
#[cfg(feature = "mock")]
pub mod mock;
mod programs;
mod record;
mod refusal;
mod seal;
mod security;
mod signature;
mod status;
mod target;
mod trial;
mod updater;
mod wear;

pub use area::{Area, Layout};
pub use authorisation::{AUTHORISATION_KEY, Authorisation, Pair, RESPONSE_LEN, response};
pub use boot::{Decision, Proof, Start, Stay, application, boot, boot_sealed};
pub use clears::Clears;
pub use crashes::{Crashes, Reset};
pub use flash::Flash;
pub use header::{Description, HEADER_LEN, Header, SIGNATURE_LEN, SIGNED_LEN, Version};
pub use image::COUNTER_STEP;
pub use log::{Cause, Event, LOG_LEN, Log, Outcome};
pub use programs::Programs;
pub use refusal::Refusal;
pub use signature::CONTEXT;
pub use status::Status;
pub use target::Target;
pub use trial::{Reason, Trial};
pub use updater::{Next, Phase, Updater};
