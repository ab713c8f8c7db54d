//! The calls of probe-rs, in their order.

use std::path::Path;
use std::process::Command;

use crate::probe::Board;

/// The files that are written.
#[derive(Clone, Copy, Debug)]
pub struct Files<'a> {
    /// The ELF file of the bootloader.
    pub bootloader: &'a Path,
    /// The signed image: header and code.
    pub image: &'a Path,
    /// The address of the header of the image.
    pub address: u32,
}

/// The calls that write the files and start the chip. Pages that are not written keep their content, so that the
/// parameters stay.
#[must_use]
pub fn write(board: &Board, files: Files<'_>) -> Vec<Command> {
    let mut bootloader = board.call("download");
    bootloader.arg(files.bootloader);
    let mut image = board.call("download");
    image.args(["--binary-format", "bin", "--base-address", &format!("{:#010x}", files.address)]);
    image.arg(files.image);
    vec![bootloader, image, board.call("reset")]
}

/// The call that prints the log of the application until Ctrl-C. The ELF file has the format strings.
#[must_use]
pub fn log(board: &Board, application: &Path) -> Command {
    let mut log = board.call("attach");
    log.arg(application);
    log
}

#[cfg(test)]
mod tests {
    use crate::probe::line;

    use super::*;

    fn lines(probe: Option<&str>) -> Vec<String> {
        let board = Board { chip: "STM32F446RETx".into(), probe: probe.map(str::to_owned) };
        let files =
            Files { bootloader: Path::new("bootloader"), image: Path::new("a.img"), address: 0x0802_0000 };
        let log = log(&board, Path::new("firmware"));
        write(&board, files).iter().chain([&log]).map(line).collect()
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
