//! An independent master, the `zencan-client` crate, judges the node: SDO, NMT, PDO configuration, LSS.

mod bus;
mod lss;
mod node;
mod transfers;
