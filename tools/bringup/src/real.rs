//! The desk with a board: probe-rs, a CAN adapter, and an operator at the keyboard.

use std::io::{BufRead, Read, Write};
use std::path::PathBuf;
use std::process::{Command, Stdio};

use anyhow::{Context, Result, ensure};
use canopen::Duration;
use nodectl::Network;
use nodectl::bus::Address;
use nodectl::update::Image;
use programmer::flash::Part;
use programmer::probe::{Board, line};

use crate::desk::{Action, Desk};

/// A board at a debug probe and a CAN adapter.
pub struct RealDesk {
    /// The board, as probe-rs names it.
    pub board: Board,
    /// The ELF file of the application, for the log.
    pub application: PathBuf,
    /// The address of the CAN adapter.
    pub address: Address,
    /// The bus.
    pub network: Network,
    /// The content written to the flash.
    pub programs: Vec<Part>,
    /// The signed image.
    pub image: Image,
}

impl RealDesk {
    fn call(&self, verb: &str, arguments: &[String]) -> Result<String> {
        let mut command = self.board.call(verb);
        command.args(arguments);
        run(&mut command).or_else(|_| {
            // A core that sleeps, or a program that switches the pins of the probe off.
            command.arg("--connect-under-reset");
            run(&mut command)
        })
    }
}

fn run(command: &mut Command) -> Result<String> {
    let output = command.output().context("cannot start probe-rs (https://probe.rs)")?;
    let said = String::from_utf8_lossy(&output.stderr);
    let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it says nothing").to_owned();
    ensure!(output.status.success(), "`{}` failed: {last}", line(command));
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// The words in the output of `probe-rs read`: each line may begin with an address and a colon.
fn words(text: &str) -> Vec<u32> {
    let values = text.lines().flat_map(|line| line.rsplit(':').next().unwrap_or_default().split_whitespace());
    values.filter_map(|digits| u32::from_str_radix(digits.trim_start_matches("0x"), 16).ok()).collect()
}

impl Desk for RealDesk {
    fn words(&mut self, address: u32, count: usize) -> Result<Vec<u32>> {
        let arguments = ["b32".to_owned(), format!("{address:#010x}"), count.to_string()];
        let text = self.call("read", &arguments)?;
        let found = words(&text);
        ensure!(found.len() == count, "probe-rs has read {text:?} at {address:#010x}");
        Ok(found)
    }

    fn write(&mut self, address: u32, value: u32) -> Result<()> {
        let arguments = ["b32".to_owned(), format!("{address:#010x}"), format!("{value:#010x}")];
        self.call("write", &arguments).map(drop)
    }

    fn reset(&mut self) -> Result<()> {
        self.call("reset", &[]).map(drop)
    }

    fn log(&mut self, span: Duration) -> Result<Vec<String>> {
        let mut command = self.board.call("attach");
        command.arg(&self.application).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut child = command.spawn().with_context(|| format!("cannot start `{}`", line(&command)))?;
        self.network.pause(span)?;
        child.kill().context("probe-rs does not end")?;
        let mut text = String::new();
        if let Some(mut output) = child.stdout.take() {
            output.read_to_string(&mut text)?;
        }
        child.wait()?;
        Ok(text.lines().map(str::to_owned).collect())
    }

    fn network(&mut self) -> &mut Network {
        &mut self.network
    }

    fn set_bit_rate(&mut self, kbit: u16) -> Result<()> {
        if !self.address.needs_bit_rate() {
            println!("Set the bit rate of {} to {kbit} kbit/s, then press Enter", self.address);
            answer()?;
        }
        let address = self.address.clone();
        self.network = Network::open(move || address.open(kbit))?;
        Ok(())
    }

    fn by_hand(&mut self, action: Action) -> Result<bool> {
        println!("{action}. Press Enter when it is done, or type s to skip it");
        Ok(answer()? != "s")
    }

    fn programs(&self) -> &[Part] {
        &self.programs
    }

    fn image(&self) -> &Image {
        &self.image
    }
}

fn answer() -> Result<String> {
    std::io::stdout().flush()?;
    let mut line = String::new();
    let read = std::io::stdin().lock().read_line(&mut line)?;
    ensure!(read > 0, "nobody is at the keyboard: this step needs hands");
    Ok(line.trim().to_lowercase())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_of_probe_rs_come_with_and_without_addresses() {
        assert_eq!(words("00000421 deadbeef\n"), [0x421, 0xDEAD_BEEF]);
        assert_eq!(words("e0042000: 0x10000421\ne0042004: 00000007\n"), [0x1000_0421, 7]);
        assert_eq!(words("no probe"), [0_u32; 0]);
    }
}
