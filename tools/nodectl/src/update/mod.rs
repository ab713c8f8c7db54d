//! Replaces the program of nodes over the bus (CiA 302-3).
//!
//! The sequence is the one of masters in the field: stop the program, clear it, download the new program, wait until
//! the node has checked it, compare its identification, start it. The node need not acknowledge stopping and starting:
//! it restarts, and answers in its new state.

mod authorisation;
mod error;
mod fleet;
mod image;
mod job;
mod program;
mod trial;
mod waiting;
mod watcher;

pub use ::update::{Event, Log, Status, Version};
pub use authorisation::AuthorisationKey;
pub use error::Error;
pub use fleet::update;
pub(crate) use image::version;
pub use image::{Image, ImageError, ImageInfo};
pub use job::{Options, Outcome};
pub use program::{Command, Program};
pub use trial::{Decision, decide};
pub use watcher::{Step, Watcher};
