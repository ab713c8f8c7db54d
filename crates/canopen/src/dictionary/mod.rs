//! The object dictionary as data.
//!
//! A personality writes one const table of [`Object`] rows. From it const functions make what the node needs at run
//! time, all of it by [`dictionary!`](crate::dictionary!): the [`Tables`], which hold no text but that of default
//! values. The rows themselves are only referenced by what writes documents on the host, so names and units never
//! reach the firmware image.
//!
//! All values of a device live in one flat byte image, little endian as on the wire. An entry knows its place.

mod check;
mod compile;
mod entry;
mod field;
mod filling;
mod group;
mod limits;
mod object;
mod packed;
mod rule;
mod tables;
mod types;

pub use check::check;
pub use compile::{Counts, Sizes, compile, count, gather, image_size};
pub use entry::Entry;
pub(crate) use entry::little_endian;
pub use field::Field;
pub use group::{Group, Groups};
pub use object::{Access, DefaultValue, Mapping, Object};
pub use packed::{BufferFull, packed_size};
pub use rule::Rule;
pub use tables::{Dictionary, Entries, Tables};
pub use types::Type;
