//! Faults that the monitor has found, or would have found: each scenario runs a node through the events that showed the
//! fault, and has no assertion about it. The monitor ends the scenario at the breach. `cargo xtask regressions` brings
//! each fault back and expects that.

mod aborts;
mod common;
mod deadlines;
mod errors;
mod identities;
mod inhibit;
mod starving;
mod states;
mod storing;
mod transfers;
