//! PDOs of dictionaries made for these tests.

mod bench;
mod bus_share;
mod deadlines;
#[allow(dead_code)] // These tests only write.
#[path = "../exchange/mod.rs"]
mod exchange;
mod handled;
mod interlocks;
mod layouts;
mod lean;
mod many;
mod places;
mod thresholds;
