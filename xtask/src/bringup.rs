//! `cargo xtask bringup`: the first hour of a board; with `--emulated`, of the emulated board.

use std::ffi::OsString;
use std::process::ExitCode;

use anyhow::Result;

use crate::command::become_program;
use crate::setup;
use crate::target::Toolchain;
use crate::{images, own_tool};

/// Builds the images and the tool, then becomes the tool.
pub(crate) fn run(flags: &[OsString]) -> Result<ExitCode> {
    let is_emulated = flags.iter().any(|flag| flag == "--emulated");
    let rest = flags.iter().filter(|flag| *flag != "--emulated");
    let asks_for_help = flags.iter().any(|flag| flag == "--help" || flag == "-h");
    setup::check(if is_emulated {
        setup::SIM
    } else if asks_for_help {
        setup::IMAGES
    } else {
        setup::FLASH
    })?;
    let images = images::compile_node(&Toolchain::ensure()?, images::CHIP)?;
    let name = if is_emulated { "bringup-emulated" } else { "bringup" };
    let mut program = own_tool::build(name)?;
    if is_emulated {
        program.arg("--images").arg(images);
    } else {
        program.arg("--bootloader").arg(images.join("bootloader"));
        program.arg("--application").arg(images.join("firmware"));
    }
    become_program(program.args(rest))
}
