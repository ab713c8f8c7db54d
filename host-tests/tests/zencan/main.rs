//! Tests of the node with an independent master, the `zencan-client` crate: SDO, NMT, PDO configuration, LSS.

mod bus;
mod lss;
mod node;
mod transfers;
