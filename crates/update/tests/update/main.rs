//! Whole updates on a mock flash.

mod bench;
mod commit_cuts;
mod corrupted;
mod header;
mod key_ranks;
mod log;
mod ordinary;
mod power_cuts;
mod sequences;
mod trial;
mod wear;
