//! The chip as a program sees it: loads and stores by address, interrupt lines, effects.

mod clocks;
mod support;
