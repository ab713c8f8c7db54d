//! Simulated devices: the library's device with the table of a data sheet, made at run time.
//!
//! [`Table`] makes the rows of a data sheet, [`Node`] is the device with them, and [`Script`] sets its values over time.

mod node;
mod pdos;
mod rows;
mod script;

pub use node::Node;
pub use rows::{Table, TableError};
pub use script::{Script, ScriptError};
