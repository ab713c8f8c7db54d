//! Programs that work with boards and cores of the emulator: [`mod@bench`] counts instructions (`cargo xtask bench`), [`glitch`]
//! injects faults into the start of the bootloader (`cargo xtask fault-injection`), and [`bringup`] is the desk of
//! `cargo xtask bringup --emulated`.
#![forbid(unsafe_code)]

pub mod bench;
pub mod bringup;
pub mod glitch;
