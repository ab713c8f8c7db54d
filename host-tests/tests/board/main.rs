//! The images on the emulated board. Needs the ELF files: `cargo xtask images` builds them.

mod configuring;
mod faults;
mod running;
mod support;
mod update;
