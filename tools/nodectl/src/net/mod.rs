//! Networks: the file of a bus, and what it wants of each node.
//!
//! [`File`] is the file, [`Plan`] is what it and the data sheets it names want. `nodectl net` checks and configures a bus
//! by them, as the boot-up of CiA 302-2 does with its objects 1F22h, 1F26h, 1F27h and 1F84h to 1F88h.

mod date;
mod file;
mod plan;

pub use date::Date;
pub use file::{File, Guarding, Identity, Member, Number, Start, schema};
pub use plan::{Plan, PlanError, PlannedNode};
