//! Reproducible images: the same sources in two folders give the same bytes.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, elf};
use start::output;

use crate::command::{root, target_dir};
use crate::images::DEVELOPMENT;
use crate::progress;
use crate::target::{TRIPLE, Toolchain};

/// The images, and the sections that are flashed.
const IMAGES: [&str; 2] = ["firmware", "bootloader"];

/// Builds the images in two folders of different depth, and compares what is flashed.
pub(crate) fn check(toolchain: &Toolchain) -> Result<()> {
    let place = target_dir().join("reproducible");
    let folders = [place.join("a"), place.join("further/below")];
    let mut builds = Vec::new();
    for folder in &folders {
        copy(folder)?;
        builds.push(build(toolchain, folder)?);
    }
    let [first, second] = builds.as_slice() else { unreachable!("two folders") };
    for image in IMAGES {
        let [one, two] = [first, second].map(|build| flashed(&build.join(image)));
        ensure!(one? == two?, "{image} depends on the folder of its sources");
    }
    Ok(())
}

/// Copies the files that git knows.
fn copy(folder: &Path) -> Result<()> {
    let files =
        output("git", &["-C", &root().display().to_string(), "ls-files"]).context("no list of the files")?;
    for file in files.lines() {
        let to = folder.join(file);
        fs::create_dir_all(to.parent().context("a file has a folder")?)?;
        fs::copy(root().join(file), to).with_context(|| format!("cannot copy {file}"))?;
    }
    Ok(())
}

fn build(toolchain: &Toolchain, folder: &Path) -> Result<PathBuf> {
    let packages: Vec<&str> = IMAGES.iter().flat_map(|image| ["-p", image]).collect();
    let mut command: Command = toolchain.cargo("build", &["--release", "--locked"]);
    command.args(packages).args(DEVELOPMENT).current_dir(folder);
    progress::build("reproducible", command.env("CARGO_TARGET_DIR", folder.join("target")))?;
    Ok(folder.join("target").join(TRIPLE).join("release"))
}

/// The bytes that are flashed, with their addresses.
fn flashed(image: &Path) -> Result<Vec<(u32, Vec<u8>)>> {
    let file = fs::read(image).with_context(|| format!("cannot read {}", image.display()))?;
    let elf = ElfFile32::<Endianness>::parse(&*file).context("it is no ELF file of 32 bits")?;
    let loaded =
        elf.elf_program_headers().iter().filter(|part| part.p_type(Endianness::Little) == elf::PT_LOAD);
    let parts: Vec<(u32, Vec<u8>)> = loaded
        .filter_map(|part| {
            let bytes = part.data(Endianness::Little, &*file).ok()?;
            (!bytes.is_empty()).then(|| (part.p_paddr(Endianness::Little), bytes.to_vec()))
        })
        .collect();
    ensure!(!parts.is_empty(), "{} has nothing to flash", image.display());
    Ok(parts)
}
