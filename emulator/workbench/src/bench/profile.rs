//! The functions of the source, inlined ones too, that the instructions of an operation belong to.

use std::collections::BTreeMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};
use emulator::Visits;
use object::{Object, ObjectSection};

/// A function with less than one in this many of the instructions gets no line.
const WORTH: u64 = 200;

/// The functions of an image, most instructions first.
pub(crate) fn functions(path: &Path, visits: &[Visits]) -> Result<Vec<(String, u64)>> {
    let loader = Loader::new(path).map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let file = std::fs::read(path)?;
    let elf = object::File::parse(file.as_slice())?;
    let text = elf.section_by_name(".text").ok_or_else(|| anyhow!("no code in {}", path.display()))?;
    let (base, code) = (text.address(), text.data()?);
    let mut sums: BTreeMap<String, u64> = BTreeMap::new();
    for block in visits {
        let start = usize::try_from(u64::from(block.address) - base)?;
        let bytes = code.get(start..start + block.size as usize).unwrap_or(&[]);
        for offset in instructions(bytes) {
            let name = function(&loader, u64::from(block.address) + offset as u64);
            *sums.entry(name).or_default() += block.count;
        }
    }
    let mut functions: Vec<_> = sums.into_iter().collect();
    functions.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    let total: u64 = functions.iter().map(|(_, count)| count).sum();
    functions.retain(|(_, count)| count * WORTH >= total);
    Ok(functions)
}

/// Offsets of the Thumb instructions in a block.
fn instructions(code: &[u8]) -> impl Iterator<Item = usize> {
    let mut next = 0;
    std::iter::from_fn(move || {
        let offset = next;
        let first = code.get(offset..offset + 2)?;
        let is_wide = first[1] >> 3 >= 0b11101;
        next += if is_wide { 4 } else { 2 };
        Some(offset)
    })
}

/// The innermost function at an address.
fn function(loader: &Loader, address: u64) -> String {
    let frame = loader.find_frames(address).ok().and_then(|mut frames| frames.next().ok().flatten());
    let name = frame.and_then(|frame| frame.function).map(|name| name.demangle().map(String::from));
    name.and_then(Result::ok).unwrap_or_else(|| "?".into())
}
