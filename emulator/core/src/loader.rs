//! Reading of ELF files.

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSection, ObjectSymbol, SectionKind, elf};

use crate::model::{Error, Model};

/// A program, ready to be written into flash.
#[derive(Clone, Debug)]
pub struct Image {
    /// The segments to write into flash.
    pub segments: Vec<Segment>,
    /// The address of `_SEGGER_RTT`, the control block of the log.
    pub rtt: Option<u32>,
    /// Bytes of flash that the program takes.
    pub flash_size: u32,
    /// Bytes of RAM that the program's variables take, without the stack.
    pub ram_size: u32,
}

impl Image {
    /// Whether a flash array contains this program.
    pub fn is_in(&self, model: &Model, flash: &[u8]) -> bool {
        self.segments.iter().all(|Segment { address, bytes }| {
            let start = (address - model.flash.start) as usize;
            flash.get(start..start + bytes.len()) == Some(bytes.as_slice())
        })
    }
}

/// Bytes at an address.
#[derive(Clone, Debug)]
pub struct Segment {
    /// The address of the first byte.
    pub address: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// Reads an ELF file for a chip.
pub(crate) fn parse(file: &[u8], model: &Model) -> Result<Image, Error> {
    let elf = ElfFile32::<Endianness>::parse(file)
        .map_err(|error| Error::Elf(format!("not an ELF file of 32 bits: {error}")))?;
    if elf.architecture() != object::Architecture::Arm {
        return Err(Error::Elf(format!("a program for {:?}, not for ARM", elf.architecture())));
    }
    let segments = segments(&elf, model)?;
    if segments.is_empty() {
        return Err(Error::Elf("nothing in it goes into flash".into()));
    }
    let rtt =
        elf.symbols().find(|symbol| symbol.name() == Ok("_SEGGER_RTT")).map(|symbol| symbol.address() as u32);
    let flash_size = segments.iter().map(|segment| segment.bytes.len() as u32).sum();
    Ok(Image { rtt, flash_size, ram_size: variables(&elf, model), segments })
}

fn segments(elf: &ElfFile32<Endianness>, model: &Model) -> Result<Vec<Segment>, Error> {
    let endian = elf.endian();
    let mut segments = Vec::new();
    for header in elf.elf_program_headers() {
        let bytes =
            header.data(endian, elf.data()).map_err(|()| Error::Elf("a segment is cut off".into()))?;
        if header.p_type(endian) != elf::PT_LOAD || bytes.is_empty() {
            continue;
        }
        let address = header.p_paddr(endian);
        let end = u64::from(address) + bytes.len() as u64;
        if address < model.flash.start || end > model.flash.end.into() {
            return Err(Error::Elf(format!("the segment at {address:#010x} does not fit the flash")));
        }
        segments.push(Segment { address, bytes: bytes.to_vec() });
    }
    Ok(segments)
}

fn variables(elf: &ElfFile32<Endianness>, model: &Model) -> u32 {
    let in_ram = |address: u64| u32::try_from(address).is_ok_and(|address| model.ram.contains(&address));
    let kinds = [SectionKind::Data, SectionKind::UninitializedData];
    elf.sections()
        .filter(|section| in_ram(section.address()) && kinds.contains(&section.kind()))
        .map(|section| section.size() as u32)
        .sum()
}
