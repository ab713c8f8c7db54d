//! A board at a debug probe: the command line flags that choose it, and the calls of probe-rs for it.
#![forbid(unsafe_code)]

use std::process::Command;

use clap::Args;

/// A chip at a debug probe.
#[derive(Args, Clone, Debug)]
pub struct Board {
    /// The chip, as probe-rs calls it
    #[arg(long, default_value = "STM32F446RETx")]
    pub chip: String,
    /// The probe, when there are several: VID:PID or VID:PID:serial number
    #[arg(long)]
    pub probe: Option<String>,
}

impl Board {
    /// A call of probe-rs for this board. The caller adds the arguments behind the verb.
    #[must_use]
    pub fn call(&self, verb: &str) -> Command {
        let mut command = Command::new("probe-rs");
        command.arg(verb).args(self.flags());
        command
    }

    /// The flags that choose the board, which are the same for probe-rs and for the tools of the project.
    pub fn flags(&self) -> impl Iterator<Item = &str> {
        let probe = self.probe.iter().flat_map(|probe| ["--probe", probe]);
        ["--chip", &self.chip].into_iter().chain(probe)
    }
}

/// A call as a command line.
#[must_use]
pub fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}
