//! `cargo xtask flash`: builds bootloader and application, then becomes the program that writes them to a board on a
//! bench. This command is also the runner of `cargo run` in `firmware`, which has built the application already.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, bail};
use clap::Args;
use programmer::probe::Board;

use start::output;

use crate::command::become_program;
use crate::setup;
use crate::target::Toolchain;
use crate::{images, own_tool};

/// The output of probe-rs when no probe is connected.
const NO_PROBE: &str = "No debug probes were found";

#[derive(Args)]
pub(crate) struct Flags {
    /// The ELF file of the application [default: the application is built]
    application: Option<PathBuf>,
    /// Write a development bootloader: it starts unsigned programs
    #[arg(long, required_unless_present = "key", conflicts_with = "key")]
    development: bool,
    /// Write the bootloader of an owner, which trusts this secret key, and sign with it
    #[arg(long)]
    key: Option<PathBuf>,
    /// The root key of the bootloader of an owner: the 64 digits of its public half
    #[arg(long, requires = "key", value_name = "DIGITS", required_unless_present = "development")]
    root_key: Option<String>,
    /// The recovery key of the bootloader of an owner: the 64 digits of its public half
    #[arg(long, requires = "root_key", value_name = "DIGITS")]
    recovery_key: Option<String>,
    /// Print what would be written, and the calls of probe-rs, and make none
    #[arg(long)]
    dry_run: bool,
    /// Leave when the program has started
    #[arg(long)]
    no_log: bool,
    #[command(flatten)]
    board: Board,
}

impl Flags {
    /// Refuses before the build when no probe or no board is connected, to save the wait for a build that is of no
    /// use.
    fn check(&self) -> Result<()> {
        setup::check(if self.dry_run { setup::IMAGES } else { setup::FLASH })?;
        if !self.dry_run && output("probe-rs", &["list"]).is_none_or(|list| list.contains(NO_PROBE)) {
            bail!(
                "no debug probe was found: connect the board by the USB socket of its ST-LINK. On Linux probe-rs needs its \
                 udev rules (https://probe.rs/docs/getting-started/probe-setup). `--dry-run` needs neither"
            );
        }
        Ok(())
    }

    /// The call of the tool with these flags.
    fn call(&self, mut tool: Command, bootloader: &Path, application: &Path) -> Command {
        tool.arg("--bootloader").arg(bootloader).arg("--application").arg(application);
        let flags = [("--dry-run", self.dry_run), ("--no-log", self.no_log)];
        tool.args(flags.iter().filter(|(_, is_set)| *is_set).map(|(flag, _)| flag));
        if self.development {
            tool.arg("--development");
        }
        if let Some(key) = &self.key {
            tool.arg("--key").arg(key);
        }
        for (flag, key) in [("--root-key", &self.root_key), ("--recovery-key", &self.recovery_key)] {
            tool.args(key.iter().flat_map(|key| [flag, key]));
        }
        tool.args(self.board.flags());
        tool
    }
}

pub(crate) fn run(flags: &Flags) -> Result<ExitCode> {
    flags.check()?;
    let tool = own_tool::build("flash")?;
    let toolchain = Toolchain::ensure()?;
    if flags.development && flags.application.is_none() {
        // The images that `cargo xtask bringup` compares with the flash.
        let images = images::compile_node(&toolchain, images::CHIP)?;
        return become_program(&mut flags.call(tool, &images.join("bootloader"), &images.join("firmware")));
    }
    let application = match &flags.application {
        Some(path) => std::path::absolute(path)?,
        None => images::compile_application(&toolchain)?,
    };
    let mut keys = Vec::new();
    if let Some(key) = &flags.key {
        keys.push(variable(key)?);
    }
    keys.extend(flags.root_key.iter().chain(&flags.recovery_key).cloned());
    let bootloader = images::compile_bootloader(&toolchain, &keys)?;
    become_program(&mut flags.call(tool, &bootloader, &application))
}

/// The public half of the key in this file, as hexadecimal digits.
fn variable(key: &Path) -> Result<String> {
    let path = key.to_str().context("a path that is no text")?;
    let line = output(own_tool::build("sign")?.get_program(), &["public", "--rank", "release", path])
        .with_context(|| {
            format!("the key cannot be read: `cargo xtask sign public --rank release {path}` says more")
        })?;
    Ok(line.split_once('=').context("`sign public` prints a variable")?.1.to_owned())
}
