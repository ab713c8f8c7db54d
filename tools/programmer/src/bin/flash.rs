//! The program behind `cargo xtask flash`. The xtask builds bootloader and application before.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};

use anyhow::{Context, Result, ensure};
use bsp::flash::sectors::FLASH;
use bsp::flash::update_layout::LAYOUT;
use clap::Parser;
use programmer::flash::Content;
use programmer::flash::probe_rs::{self, Files};
use programmer::probe::{Board, line};
use programmer::sign::key;

/// Writes bootloader and signed application into a board at a debug probe, with probe-rs, and prints the log.
#[derive(Parser)]
#[command(name = "flash", version)]
struct Cli {
    /// The ELF file of the bootloader
    #[arg(long)]
    bootloader: PathBuf,
    /// The ELF file of the application
    #[arg(long)]
    application: PathBuf,
    /// The bootloader is one for development, and the development key signs
    #[arg(long, required_unless_present = "key", conflicts_with = "key")]
    development: bool,
    /// The secret key of the owner to sign with, PKCS#8 in PEM
    #[arg(long)]
    key: Option<PathBuf>,
    /// The root key that the bootloader must have: the 64 digits of its public half
    #[arg(long, requires = "key", value_name = "DIGITS", required_unless_present = "development")]
    root_key: Option<String>,
    /// The recovery key that the bootloader must have: the 64 digits of its public half
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

fn main() -> ExitCode {
    run(&Cli::parse()).map_or_else(
        |error| {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        },
        |()| ExitCode::SUCCESS,
    )
}

fn run(cli: &Cli) -> Result<()> {
    let development = key::development_path();
    let key =
        key::read(if cli.development { &development } else { cli.key.as_ref().unwrap_or(&development) })?;
    let others = cli.root_key.iter().chain(&cli.recovery_key);
    let others = others.map(|digits| key::public(digits)).collect::<Result<Vec<_>>>()?;
    let content = Content::new(&read(&cli.bootloader)?, &read(&cli.application)?, key, others)?;
    println!("{content}");
    if !cli.dry_run {
        programmer::probe::check_version().map_err(anyhow::Error::msg)?;
    }
    let image = cli.application.with_extension("flash.img");
    std::fs::write(&image, content.image().to_bytes())
        .with_context(|| format!("cannot write {}", image.display()))?;
    let address = FLASH + LAYOUT.application().start();
    let calls = probe_rs::write(&cli.board, Files { bootloader: &cli.bootloader, image: &image, address });
    let log = (!cli.no_log).then(|| probe_rs::log(&cli.board, &cli.application));
    calls.into_iter().chain(log).try_for_each(|call| if cli.dry_run { show(&call) } else { make(call) })
}

fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

fn show(call: &Command) -> Result<()> {
    println!("{}", line(call));
    Ok(())
}

/// Runs a call of probe-rs, which prints errors on its standard error output.
fn make(mut call: Command) -> Result<()> {
    let status = call.status().with_context(|| format!("cannot start `{}`", line(&call)))?;
    ensure!(status.success(), "`{}` failed ({status})", line(&call));
    Ok(())
}
