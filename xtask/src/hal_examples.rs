//! Examples of the stm32f4xx-hal package, compiled unchanged from the published source. With them the emulated board
//! runs programs that were not written for it.
//!
//! The examples get a package of their own in the build directory, with the few dependencies that they need. The
//! package of the HAL needs some hundred dependencies for all of its examples.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};
use serde::Deserialize;

use crate::command::{cargo, root, target_dir};
use crate::progress;
use crate::target::Toolchain;

/// The file names of the examples. The programs have the same names after `hal-`.
const EXAMPLES: [&str; 4] = ["blinky-timer-irq", "delay-timer-blinky", "dwt-blinky", "timer-syst"];

const HAL: &str = "stm32f4xx-hal";

/// The dependencies of the examples besides the HAL. The profile is the one of the images, so that common dependencies
/// are compiled once.
const MANIFEST: &str = r#"
[dependencies]
cortex-m = { version = "0.7.7", features = ["critical-section-single-core"] }
cortex-m-rt = "0.7.3"
cortex-m-semihosting = "=0.5.0"
nb = "1.1.0"
panic-halt = "=1.0.0"

[workspace]

[profile.release]
opt-level = "s"
lto = "fat"
codegen-units = 1
debug = 2
panic = "abort"
overflow-checks = false
"#;

/// The build script, which links the programs for a microcontroller.
const BUILD: &str = "fn main() {\n    println!(\"cargo::rustc-link-search={}\", env!(\"CARGO_MANIFEST_DIR\"));\n    println!(\"cargo::rustc-link-arg=-Tlink.x\");\n}\n";

/// Flash and RAM of an STM32F446xE.
const MEMORY: &str = "MEMORY\n{\n  FLASH : ORIGIN = 0x08000000, LENGTH = 512K\n  RAM : ORIGIN = 0x20000000, LENGTH = 128K\n}\n";

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    version: String,
    manifest_path: PathBuf,
}

/// Compiles the examples. Their ELF files are beside those of the images.
pub(crate) fn build(toolchain: &Toolchain) -> Result<()> {
    let hal = published()?;
    let source = hal.manifest_path.parent().context("a manifest lies in a folder")?.join("examples");
    let folder = target_dir().join("hal-examples");
    fs::create_dir_all(&folder)?;
    write_if_new(&folder.join("Cargo.toml"), &manifest(&hal.version, &source)?)?;
    write_if_new(&folder.join("build.rs"), BUILD)?;
    write_if_new(&folder.join("memory.x"), MEMORY)?;
    if !folder.join("Cargo.lock").exists() {
        fs::copy(root().join("Cargo.lock"), folder.join("Cargo.lock"))?;
    }
    let mut command = toolchain.cargo("build", &["--release", "--bins"]);
    command.arg("--manifest-path").arg(folder.join("Cargo.toml")).env("CARGO_TARGET_DIR", target_dir());
    progress::build("HAL examples", &mut command)
}

/// The HAL package in the version of the firmware.
fn published() -> Result<Package> {
    let output = cargo().args(["metadata", "--format-version", "1", "--locked"]).output()?;
    ensure!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Metadata = serde_json::from_slice(&output.stdout)?;
    metadata.packages.into_iter().find(|package| package.name == HAL).context("the firmware has no HAL")
}

#[allow(clippy::unnecessary_debug_formatting, reason = "TOML quotes a path as Rust does")]
fn manifest(version: &str, source: &Path) -> Result<String> {
    let mut text =
        String::from("[package]\nname = \"hal-examples\"\nversion = \"0.0.0\"\nedition = \"2024\"\n");
    for example in EXAMPLES {
        let path = source.join(format!("{example}.rs"));
        ensure!(path.exists(), "{HAL} {version} has no example {example}");
        write!(text, "\n[[bin]]\nname = \"hal-{example}\"\npath = {path:?}\ntest = false\n")?;
    }
    text += MANIFEST;
    write!(text, "\n[dependencies.{HAL}]\nversion = \"={version}\"\nfeatures = [\"stm32f446\"]\n")?;
    Ok(text)
}

/// Writes a file only when its text changes, because cargo compiles again after a write.
fn write_if_new(path: &Path, text: &str) -> Result<()> {
    if fs::read_to_string(path).ok().as_deref() == Some(text) {
        return Ok(());
    }
    fs::write(path, text).with_context(|| format!("{} cannot be written", path.display()))
}
