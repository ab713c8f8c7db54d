//! PDO: process data, mapped from and to the dictionary (CiA 301, 7.2.2).

mod budget;
mod mapping;
mod multiplexed;
mod rpdo;
mod scanner;
mod tpdo;

pub use crate::dictionary::{Addressing, MappedObject, Transmission};
pub(crate) use budget::{Budget, Choices, ProcessContext};
pub(crate) use mapping::{Chain, Content, Layout, Links, Located, locate};
pub use multiplexed::{Address, Mpdo};
pub(crate) use rpdo::{Reception, Rpdo, RpdoFault, RpdoSettings};
pub(crate) use scanner::{Scanner, ScannerSettings, Watched};
pub(crate) use tpdo::{Settings, Tpdo};
