//! `cargo xtask panics` and `cargo xtask stack`.
#![forbid(unsafe_code)]

use std::path::PathBuf;

use anyhow::{Result, ensure};
use callgraph::{Bound, IMAGES, check_panics, stack_bound};
use clap::{Parser, Subcommand};

/// Reads the images: which calls lead to a panic, and how deep the stack can get.
#[derive(Parser)]
#[command(version)]
struct Cli {
    /// The directory with the ELF files of the images
    #[arg(long)]
    images: PathBuf,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Compare the calls that lead to a panic with the known calls
    Panics {
        /// Ignore the known calls of functions whose path contains this, to see the check fail
        #[arg(long)]
        forget: Option<String>,
    },
    /// Print the bound of the stack of each image
    Stack {
        /// Show the functions of each way
        #[arg(long)]
        paths: bool,
    },
}

fn main() -> Result<()> {
    let Cli { images, command } = Cli::parse();
    match command {
        Command::Panics { forget } => check_panics(&images, forget.as_deref()),
        Command::Stack { paths } => IMAGES.into_iter().try_for_each(|name| {
            let bound = stack_bound(&images, name)?;
            println!("{name}\n{bound}");
            if paths {
                print_paths(&bound);
            }
            ensure!(bound.bytes() <= bound.reserved, "the stack of the {name} can overflow");
            Ok(())
        }),
    }
}

fn print_paths(bound: &Bound) {
    for level in [&bound.start_up].into_iter().chain(&bound.levels) {
        println!("{}", level.name);
        for (function, bytes) in &level.path {
            println!("{bytes:>8}  {function}");
        }
    }
}
