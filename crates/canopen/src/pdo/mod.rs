//! PDO: process data, mapped from and to the dictionary (CiA 301, 7.2.2).

mod mapping;
mod rpdo;
mod set;
mod tpdo;
mod transmission;

pub use mapping::MappedObject;
pub(crate) use mapping::{Direction, Layout, locate};
pub(crate) use rpdo::{Reception, Rpdo, RpdoSettings};
pub(crate) use set::PdoSet;
pub(crate) use tpdo::{Settings, Tpdo};
pub use transmission::Transmission;
