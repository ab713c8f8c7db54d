//! Reports of a run, for people and for machines.

mod frames;
mod html;
mod json;
mod junit;

pub use html::html;
pub use json::json;
pub use junit::junit;
