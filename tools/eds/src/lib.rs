//! Electronic data sheets (CiA 306).
//!
//! [`Eds`] is a data sheet as a value. [`Device::eds`] makes a data sheet from the dictionary table of a personality,
//! and [`Device::sheet`] makes the text. [`Eds::parse`] reads the text of any vendor. [`files`] is all generated text
//! in the tree of the project: the data sheets of the devices, the reference page and the data sheet of the product. `cargo xtask eds` writes these files.
#![forbid(unsafe_code)]

mod compact;
mod data_sheet;
mod dcf;
mod device;
mod edition;
mod error;
mod find;
mod gaps;
mod generated;
mod ini;
mod model;
mod page;
mod read;
mod types;
mod value;
mod write;

pub use canopen::eds::Reals;
pub use dcf::Commissioning;
pub use device::{DEVICES, Device};
pub use edition::Edition;
pub use error::{Error, Problem};
pub use find::{LookupError, address};
pub use generated::{File, files};
pub use model::{DeviceInfo, Eds, Entry, Flags, Object};
pub use types::{Access, Class, DataType, ObjectType};
pub use value::{Formula, Value};
