//! `cargo xtask pictures`: pictures of the page in a browser and of the simulator's screen, for the documentation.

use std::process::Command;

use anyhow::Result;

use crate::command::{root, run};
use crate::own_tool::Tools;
use crate::setup::{self, emulator, python};
use crate::test::suite::{with_images, with_programs};
use crate::{images, progress};

/// Builds the programs and the images, and takes the pictures with a browser.
pub(crate) fn take() -> Result<()> {
    setup::check(setup::PICTURES)?;
    setup::install(setup::PICTURES)?;
    let mut build = emulator::cargo_with_emulator()?;
    build.args(["build", "--profile", "sim", "-p", "sim", "-p", "nodectl", "-p", "programmer"]);
    progress::build("programs", &mut build)?;
    images::build(Tools::Built)?;
    let mut command = Command::new(python::clients()?);
    command.arg("host-tests/python/pictures.py").current_dir(root());
    run(with_images(with_programs(&mut command), false))
}
