//! `nodectl completions` and `nodectl man`: shell completions and manual pages.

use std::io;
use std::path::PathBuf;

use clap::{Args, CommandFactory};
use clap_complete::Shell;

use super::{Cli, Failure, Session};

/// Prints the completions of a shell.
///
/// For bash: nodectl completions bash > ~/.local/share/bash-completion/completions/nodectl
#[derive(Debug, Args)]
pub(super) struct Completions {
    /// The shell.
    shell: Shell,
}

impl Completions {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), NAME, &mut script);
        Ok(session.output.write(&script)?)
    }
}

/// Prints the manual page, or writes a page for every command.
#[derive(Debug, Args)]
pub(super) struct Man {
    /// Write nodectl.1, nodectl-read.1 and so on into this directory.
    #[arg(long, value_name = "DIR")]
    dir: Option<PathBuf>,
}

impl Man {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        match &self.dir {
            Some(dir) => {
                let written = clap_mangen::generate_to(Cli::command(), dir);
                written.map_err(|error| {
                    let reason = format!("{}: {error}", dir.display());
                    io::Error::new(error.kind(), reason)
                })?;
            }
            None => {
                let mut page = Vec::new();
                clap_mangen::Man::new(Cli::command()).render(&mut page)?;
                session.output.write(&page)?;
            }
        }
        Ok(())
    }
}

/// The name of the command.
const NAME: &str = "nodectl";
