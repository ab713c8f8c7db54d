//! PDO: process data, mapped from and to the dictionary (CiA 301, 7.2.2).

mod budget;
mod links;
mod mapping;
mod multiplexed;
mod rpdo;
mod scanner;
mod tpdo;
mod transmission;

pub(crate) use budget::Budget;
pub(crate) use links::{Chain, Links};
pub use mapping::MappedObject;
pub(crate) use mapping::{Content, Direction, Layout, locate};
pub use multiplexed::{Address, Addressing, Mpdo};
pub(crate) use rpdo::{Reception, Rpdo, RpdoFault, RpdoSettings};
pub(crate) use scanner::{Scanner, ScannerSettings, Watched};
pub(crate) use tpdo::{Settings, Tpdo};
pub use transmission::Transmission;
