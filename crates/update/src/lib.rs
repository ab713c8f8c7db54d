//! Field update of the application over CAN (CiA 302-3), safe against a power cut at any moment and against images that
//! are damaged, for another device, too old, or not signed.
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]
#![cfg_attr(
    not(any(test, feature = "mock")),
    warn(
        clippy::indexing_slicing,
        clippy::arithmetic_side_effects,
        clippy::unwrap_used,
        clippy::expect_used
    )
)]

#[cfg(any(test, feature = "mock"))]
extern crate std;

mod area;
mod boot;
mod checksum;
mod commit;
mod copy;
mod erase;
mod flash;
mod header;
mod image;
pub mod key;
#[cfg(feature = "mock")]
pub mod mock;
mod receive;
mod refusal;
mod signature;
mod status;
mod target;
mod trial;
mod updater;

pub use area::{Area, Layout};
pub use boot::{Decision, Start, Stay, application, boot};
pub use flash::Flash;
pub use header::{Description, HEADER_LEN, Header, SIGNATURE_LEN, SIGNED_LEN, Version};
pub use refusal::Refusal;
pub use signature::CONTEXT;
pub use status::Status;
pub use target::Target;
pub use trial::{Reset, Trial};
pub use updater::{Next, Phase, Updater};
