//! The library against nodes in this process, in virtual time.

mod blocks;
mod loader;
mod lss;
mod pressure;
mod transfers;
mod update;
mod wire;
