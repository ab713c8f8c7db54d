//! The code of our devices by module of the source, inlined functions too.

use std::collections::BTreeMap;
use std::path::Path;

use addr2line::Loader;
use anyhow::{Result, anyhow};
use object::{Object, ObjectSection};

use crate::bench::report::DEVICES;

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
        *modules.entry(module(&loader, address)).or_default() += 2;
    }
    Ok(modules)
}

/// The innermost module of the library at an address. Code of the standard library counts as that of its caller, if it
/// is inlined.
fn module(loader: &Loader, address: u64) -> String {
    let mut frames = loader.find_frames(address).ok();
    while let Some(frame) = frames.as_mut().and_then(|frames| frames.next().ok().flatten()) {
        let file = frame.location.and_then(|location| location.file).unwrap_or_default();
        if let Some((_, path)) = file.split_once("canopen/src/") {
            return path.trim_end_matches(".rs").trim_end_matches("/mod").into();
        }
    }
    "other crates".into()
}
