//! The whole device, on a bench: a small dictionary, frames in and frames out.

mod bench;
mod block;
mod dictionary;
mod emcy;
mod events;
mod heartbeat;
mod hooks;
mod lss;
mod mapping;
mod multiplexed;
mod nmt;
mod robustness;
mod rpdo;
mod sdo;
mod states;
mod store;
mod sync;
mod tpdo;
