//! The code of an image, from an ELF file or a flat binary.

use anyhow::{Context, Result, bail, ensure};
use bsp::flash::sectors::FLASH;
use bsp::flash::update_layout::LAYOUT;
use object::Endianness;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Object, elf};
use update::HEADER_LEN;

/// The value of erased flash.
const ERASED: u8 = 0xFF;

/// The address of the vector table of an application: after the header.
#[must_use]
pub fn start() -> u32 {
    FLASH + LAYOUT.application().start() + HEADER_LEN as u32
}

/// The greatest size of the code, in bytes.
#[must_use]
pub fn most() -> usize {
    LAYOUT.longest_image() as usize - HEADER_LEN
}

/// The code in a file, as whole words. Of an ELF file, the parts that are loaded into flash; of any other file, all
/// bytes.
///
/// # Errors
/// The reason why the file is no application.
pub fn read(file: &[u8]) -> Result<Vec<u8>> {
    let mut code = if file.starts_with(&elf::ELFMAG) { flatten(file)? } else { file.to_vec() };
    ensure!(!code.is_empty(), "there is no code");
    code.resize(code.len().next_multiple_of(4), ERASED);
    ensure!(code.len() <= most(), "{} bytes of code, and there is room for {}", code.len(), most());
    Ok(code)
}

fn flatten(file: &[u8]) -> Result<Vec<u8>> {
    let elf = ElfFile32::<Endianness>::parse(file).context("a damaged ELF file, or none of 32 bits")?;
    ensure!(elf.architecture() == object::Architecture::Arm, "an ELF file for another processor");
    let mut code = Vec::new();
    for segment in elf.elf_program_headers() {
        let content = segment.data(Endianness::Little, file);
        let Ok(content) = content else { bail!("a segment that is not in the file") };
        if segment.p_type(Endianness::Little) == elf::PT_LOAD && !content.is_empty() {
            place(&mut code, segment.p_paddr(Endianness::Little), content)?;
        }
    }
    Ok(code)
}

/// Copies a segment to its load address. The gaps between segments stay erased.
fn place(code: &mut Vec<u8>, address: u32, content: &[u8]) -> Result<()> {
    let room = address.checked_sub(start()).map(|at| at as usize..at as usize + content.len());
    let Some(room) = room.filter(|room| room.end <= most()) else {
        bail!("{} bytes at {address:#010x} are outside of the application area", content.len());
    };
    code.resize(code.len().max(room.end), ERASED);
    code[room].copy_from_slice(content);
    Ok(())
}
