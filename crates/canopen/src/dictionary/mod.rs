//! The object dictionary as data.
//!
//! A personality defines one const table of [`Object`] rows. [`dictionary!`](crate::dictionary!) compiles it with const
//! functions to the run-time [`Tables`], whose only text is the default values of strings. Only the code that writes
//! documents on the host refers to the rows themselves, so names and units never reach the firmware image.
//!
//! All values of a device are in one flat byte image, little endian as on the bus. An entry contains the location of
//! its value.

mod builder;
mod check;
mod check_301;
mod check_pdos;
mod compile;
mod entry;
mod fail;
mod field;
mod group;
mod object;
mod packed;
mod pdo;
mod rule;
mod services;
mod tables;
mod transmission;
mod types;
mod variable;

#[doc(hidden)]
pub use builder::TableBuilder;
pub use check::check;
pub use check_301::check_301;
pub use compile::{Counts, Sizes, compile, count, gather, image_size, pdos, scanned, servers, watches};
pub use entry::Entry;
pub(crate) use entry::{Kind, little_endian};
pub(crate) use fail::fail;
pub use field::Field;
pub use group::{Group, Groups};
pub use object::{Access, DefaultValue, Mapping, Object};
pub use packed::{BufferFull, is_packed, packed_size};
pub(crate) use pdo::Direction;
#[doc(hidden)]
pub use pdo::{Addressing, MappedObject};
pub use rule::Rule;
pub use services::Services;
pub use tables::{Dictionary, Entries, Tables};
#[doc(hidden)]
pub use transmission::Transmission;
pub use types::Type;
pub use variable::{Number, Variable};
