//! The calls of probe-rs, in their order.

use std::path::Path;
use std::process::Command;

/// A chip at a debug probe.
#[derive(Clone, Debug)]
pub struct Board {
    /// The name that probe-rs has for the chip.
    pub chip: String,
    /// VID:PID or VID:PID:serial number, when there are several probes.
    pub probe: Option<String>,
}

/// The files that are written.
#[derive(Clone, Copy, Debug)]
pub struct Files<'a> {
    /// The ELF file of the bootloader.
    pub bootloader: &'a Path,
    /// The signed image: header and code.
    pub image: &'a Path,
    /// The address of its header.
    pub address: u32,
}

impl Board {
    /// What writes the files and starts the chip. Pages that are not written keep what they hold: the parameters stay.
    #[must_use]
    pub fn write(&self, files: Files<'_>) -> Vec<Command> {
        let mut bootloader = self.call("download");
        bootloader.arg(files.bootloader);
        let mut image = self.call("download");
        image.args(["--binary-format", "bin", "--base-address", &format!("{:#010x}", files.address)]);
        image.arg(files.image);
        vec![bootloader, image, self.call("reset")]
    }

    /// What prints the log of the application until Ctrl-C, by the format strings of its ELF file.
    #[must_use]
    pub fn log(&self, application: &Path) -> Command {
        let mut log = self.call("attach");
        log.arg(application);
        log
    }

    fn call(&self, verb: &str) -> Command {
        let mut command = Command::new("probe-rs");
        command.args([verb, "--chip", &self.chip]);
        if let Some(probe) = &self.probe {
            command.args(["--probe", probe]);
        }
        command
    }
}

/// A call as one would type it.
#[must_use]
pub fn line(command: &Command) -> String {
    let words = std::iter::once(command.get_program()).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(probe: Option<&str>) -> Vec<String> {
        let board = Board { chip: "STM32F446RETx".into(), probe: probe.map(str::to_owned) };
        let files =
            Files { bootloader: Path::new("bootloader"), image: Path::new("a.img"), address: 0x0802_0000 };
        let log = board.log(Path::new("firmware"));
        board.write(files).iter().chain([&log]).map(line).collect()
    }

    #[test]
    fn the_bootloader_comes_first_and_the_log_last() {
        let expected = [
            "probe-rs download --chip STM32F446RETx bootloader",
            "probe-rs download --chip STM32F446RETx --binary-format bin --base-address 0x08020000 a.img",
            "probe-rs reset --chip STM32F446RETx",
            "probe-rs attach --chip STM32F446RETx firmware",
        ];
        assert_eq!(lines(None), expected);
    }

    #[test]
    fn every_call_names_the_probe() {
        let chosen = lines(Some("0483:374b"));
        assert!(chosen.iter().all(|line| line.contains("--probe 0483:374b")), "{chosen:?}");
    }
}
