//! The whole device on a test bench: a small dictionary, frames in and frames out.

mod application;
mod bench;
mod block;
mod channels;
mod dictionary;
mod domains;
mod emcy;
mod emcy_detail;
mod emergencies;
mod events;
#[path = "../exchange/mod.rs"]
mod exchange;
mod guarding;
mod heartbeat;
mod hooks;
mod indicators;
mod long_time;
mod lss;
mod mapping;
mod multiplexed;
mod nmt;
mod own_groups;
mod producers;
mod requests;
mod robustness;
mod rows;
mod rpdo;
mod sdo;
mod service_device;
mod states;
mod store;
mod store_at_once;
mod sync;
mod tpdo;
mod types;
mod wrong_tables;
