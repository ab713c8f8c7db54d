//! The code of our devices by module of the source, inlined functions too.

use std::collections::BTreeMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};
use object::{Object, ObjectSection};

use crate::report::DEVICES;

/// Prints the bytes of each module in each of our devices.
pub(crate) fn print(images: &Path) -> Result<()> {
    let devices: Vec<_> =
        DEVICES.iter().map(|(_, image, _)| by_module(&images.join(image))).collect::<Result<_>>()?;
    let names: Vec<_> = DEVICES.iter().map(|(name, ..)| name.trim_start_matches("flash, ")).collect();
    println!("| module | {} |\n|---|{}", names.join(" | "), "---:|".repeat(names.len()));
    let mut modules: Vec<&String> = devices.iter().flat_map(BTreeMap::keys).collect();
    modules.sort_unstable();
    modules.dedup();
    for module in modules {
        let cells: Vec<_> =
            devices.iter().map(|device| device.get(module).copied().unwrap_or(0).to_string()).collect();
        println!("| {module} | {} |", cells.join(" | "));
    }
    Ok(())
}

/// The bytes of code that each module of the library takes; code of other crates is one line.
fn by_module(image: &Path) -> Result<BTreeMap<String, u64>> {
    let loader = Loader::new(image).map_err(|error| anyhow!("{}: {error}", image.display()))?;
    let file = std::fs::read(image)?;
    let elf = object::File::parse(file.as_slice())?;
    let text = elf.section_by_name(".text").ok_or_else(|| anyhow!("no code in {}", image.display()))?;
    let mut modules = BTreeMap::new();
    for address in (text.address()..text.address() + text.size()).step_by(2) {
        let frame = loader.find_frames(address).ok().and_then(|mut frames| frames.next().ok().flatten());
        let file = frame.and_then(|frame| frame.location).and_then(|location| location.file);
        *modules.entry(module(file.unwrap_or_default())).or_default() += 2;
    }
    Ok(modules)
}

/// The module of a source file: its path in the library.
fn module(file: &str) -> String {
    match file.split_once("canopen/src/") {
        Some((_, path)) => path.trim_end_matches(".rs").trim_end_matches("/mod").into(),
        None => "other crates".into(),
    }
}
