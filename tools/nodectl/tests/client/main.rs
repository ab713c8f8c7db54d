//! Tests of the library with nodes in this process, in virtual time.

#[cfg(feature = "arrow")]
mod arrow;
mod bad_input;
mod blocks;
mod check;
mod cloning;
mod commands;
mod configuration;
mod everyday;
mod guests;
mod hostile;
mod loader;
mod lss;
mod meanings;
mod net;
mod order;
mod pressure;
mod process;
mod rules;
mod safety;
mod simulate;
mod slow_bus;
#[cfg(unix)]
mod targets;
mod texts;
mod trace;
mod transfers;
mod update;
mod update_disturbed;
mod wire;
