//! A board at a debug probe: the command line flags that choose it, and the calls of probe-rs for it.

use std::process::Command;

use clap::Args;

/// The oldest probe-rs: older ones switch the debug port off at the end of each call, and the core then sleeps for most
/// of the time (probe-rs issue 2851).
const OLDEST: (u32, u32) = (0, 25);

/// Refuses a probe-rs that is missing or too old.
///
/// # Errors
/// The mistake, in a line.
pub fn check_version() -> Result<(), String> {
    let output = Command::new("probe-rs").arg("--version").output();
    let output = output.map_err(|error| format!("cannot start probe-rs (https://probe.rs): {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let found = version(&text).ok_or_else(|| format!("`probe-rs --version` says {:?}", text.trim()))?;
    if found >= OLDEST {
        return Ok(());
    }
    let ((major, minor), (least, minor_least)) = (found, OLDEST);
    Err(format!("probe-rs {major}.{minor} is too old; {least}.{minor_least} or newer is needed"))
}

fn version(text: &str) -> Option<(u32, u32)> {
    let mut numbers = text.split_whitespace().nth(1)?.split('.');
    Some((numbers.next()?.parse().ok()?, numbers.next()?.parse().ok()?))
}

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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_old_probe_rs_is_rejected() {
        assert_eq!(version("probe-rs 0.29.1 (git commit: abc)"), Some((0, 29)));
        assert!(version("probe-rs 0.24.0").unwrap() < OLDEST && version("probe-rs 1.0.0").unwrap() > OLDEST);
        assert_eq!(version("something"), None);
    }
}
