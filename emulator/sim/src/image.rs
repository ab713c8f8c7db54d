//! An ELF file: what it takes of flash and RAM, and what its log needs to be read.

use std::ops::Range;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail, ensure};
use defmt_decoder::Table;
use object::elf::{EM_ARM, PT_LOAD};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol};

/// Addresses of the flash array.
pub(crate) const FLASH: Range<u64> = 0x0800_0000..0x0810_0000;
/// Addresses of SRAM1 and SRAM2.
const RAM: Range<u64> = 0x2000_0000..0x2002_0000;

/// One of the two files that a board runs.
pub struct Image {
    /// Where it was read from, for messages.
    pub path: PathBuf,
    /// The file.
    pub elf: Vec<u8>,
    /// Bytes of flash that it occupies.
    pub flash: u32,
    /// Bytes of RAM that it occupies without its stack.
    pub ram: u32,
    /// Address of the RTT control block.
    pub(crate) rtt: Option<u32>,
    /// The log's format strings.
    pub(crate) log: Option<Table>,
}

impl Image {
    /// Reads a file; the error is one line that names it.
    pub fn load(path: &Path) -> Result<Image> {
        let elf = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        Image::parse(path, elf).with_context(|| format!("{} is not an image for the board", path.display()))
    }

    fn parse(path: &Path, elf: Vec<u8>) -> Result<Image> {
        let file = ElfFile32::<Endianness>::parse(elf.as_slice())?;
        let endian = file.endian();
        ensure!(file.elf_header().e_machine(endian) == EM_ARM, "it is not for an Arm core");
        let (mut flash, mut ram) = (0, 0);
        for header in file.elf_program_headers().iter().filter(|header| header.p_type(endian) == PT_LOAD) {
            if FLASH.contains(&header.p_paddr(endian).into()) {
                flash += header.p_filesz(endian);
            }
            if RAM.contains(&header.p_vaddr(endian).into()) {
                ram += header.p_memsz(endian);
            }
        }
        if flash == 0 {
            bail!("it puts nothing into flash");
        }
        let rtt = file.symbol_by_name("_SEGGER_RTT").and_then(|symbol| symbol.address().try_into().ok());
        let log = Table::parse(&elf).context("its log table")?;
        Ok(Image { path: path.to_owned(), elf, flash, ram, rtt, log })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The message of the error, all of its causes in one line.
    fn refused(bytes: &[u8]) -> String {
        format!("{:#}", Image::parse(Path::new("x"), bytes.to_vec()).err().unwrap())
    }

    #[test]
    fn what_is_no_image_is_an_error_and_no_panic() {
        let own = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        for bytes in [&b""[..], b"\x7fELF", &own[..64], &own] {
            assert!(!refused(bytes).contains('\n'));
        }
        assert!(Image::load(Path::new("/nowhere")).err().unwrap().to_string().contains("/nowhere"));
    }
}
