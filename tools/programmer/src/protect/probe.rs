//! Access to registers through `probe-rs`, with a call for each access. A call does not reset the chip, so that the
//! lock stays open between two calls.

use std::io;
use std::process::{Command, ExitStatus, Stdio};

use crate::probe::{Board, line};

use crate::protect::option_bytes::OptionBytes;
use crate::protect::sequence::{OPTCR, Registers};

/// Why a register could not be reached.
#[derive(Debug, thiserror::Error)]
pub enum ProbeError {
    /// probe-rs cannot be started.
    #[error("cannot start probe-rs (https://probe.rs): {0}")]
    Start(io::Error),
    /// probe-rs has failed, and has printed the reason on its standard error output.
    #[error("`{0}` failed ({1})")]
    Failed(String, ExitStatus),
    /// The output of probe-rs is not a word.
    #[error("probe-rs has read {0:?}")]
    Answer(String),
}

/// A chip at a debug probe.
pub struct Probe(Board);

impl Probe {
    /// Access to the registers of this board.
    #[must_use]
    pub fn new(board: Board) -> Probe {
        Probe(board)
    }

    fn command(&self, verb: &str, address: u32, last: &str) -> Command {
        let mut command = self.0.call(verb);
        command.args(["b32", &format!("{address:#010x}"), last]);
        command
    }
}

impl Registers for Probe {
    type Error = ProbeError;

    fn read(&mut self, address: u32) -> Result<u32, ProbeError> {
        let text = answer(self.command("read", address, "1"))?;
        word(&text).ok_or(ProbeError::Answer(text))
    }

    fn write(&mut self, address: u32, value: u32) -> Result<(), ProbeError> {
        answer(self.command("write", address, &format!("{value:#010x}"))).map(drop)
    }
}

fn answer(mut command: Command) -> Result<String, ProbeError> {
    let mut output = command.stderr(Stdio::inherit()).output().map_err(ProbeError::Start)?;
    if !output.status.success() {
        // A core that sleeps, or a program that switches the pins of the probe off.
        output = command.arg("--connect-under-reset").output().map_err(ProbeError::Start)?;
    }
    if !output.status.success() {
        return Err(ProbeError::Failed(line(&command), output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The word in the output of probe-rs: eight digits, behind the address in some of its formats.
fn word(text: &str) -> Option<u32> {
    let digits = text.split_whitespace().next_back()?;
    u32::from_str_radix(digits.trim_start_matches("0x"), 16).ok()
}

/// Prints the calls instead of making them, and behaves like a chip that is never busy.
pub struct DryRun {
    probe: Probe,
    option_bytes: u32,
}

impl DryRun {
    /// A dry run that starts with these option bytes.
    #[must_use]
    pub fn new(probe: Probe, has: OptionBytes) -> DryRun {
        DryRun { probe, option_bytes: has.register() }
    }
}

impl Registers for DryRun {
    type Error = ProbeError;

    fn read(&mut self, address: u32) -> Result<u32, ProbeError> {
        println!("{}", line(&self.probe.command("read", address, "1")));
        Ok(if address == OPTCR { self.option_bytes } else { 0 })
    }

    fn write(&mut self, address: u32, value: u32) -> Result<(), ProbeError> {
        println!("{}", line(&self.probe.command("write", address, &format!("{value:#010x}"))));
        if address == OPTCR {
            self.option_bytes = OptionBytes::from_register(value).register();
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_word_is_found_in_the_output_of_probe_rs() {
        for text in ["0fffaaed\n", "0fffaaed \n", "0x0fffaaed", "40023c14: 0fffaaed\n"] {
            assert_eq!(word(text), Some(0x0FFF_AAED), "{text}");
        }
        assert_eq!((word(""), word("no probe was found")), (None, None));
    }

    #[test]
    fn the_calls_are_those_of_the_handbook() {
        let probe = Probe::new(Board { chip: "STM32F446RETx".into(), probe: Some("0483:374b".into()) });
        let read = line(&probe.command("read", 0x4002_3C14, "1"));
        assert_eq!(read, "probe-rs read --chip STM32F446RETx --probe 0483:374b b32 0x40023c14 1");
    }
}
