//! storage
#![no_std]
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

#[cfg(any(test, feature = "mock"))]
extern crate std;

mod device;
mod error;
mod format;
mod group;
mod memory;
#[cfg(feature = "mock")]
pub mod mock;
mod page;
mod provision;
mod scan;
mod store;
mod view;
mod writer;

pub use device::DeviceRecord;
pub use error::Error;
pub use group::{Change, Group, Health, Loaded};
pub use memory::Memory;
pub use page::Pages;
pub use provision::{provision, read};
pub use store::{MAX_VALUE, Store};
pub use view::View;
