//! The ELF files for the Cortex-M4.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Result, ensure};

use crate::command::{root, run, target_dir};
use crate::own_tool::Tools;
use crate::progress;
use crate::target::{TRIPLE, Toolchain};

/// Where the ELF files lie.
pub(crate) fn dir() -> PathBuf {
    target_dir().join(TRIPLE).join("release")
}

/// A bootloader that starts what nobody has signed, and trusts the key that everybody knows: for a board on a desk, emulated or not.
pub(crate) const DEVELOPMENT: [&str; 2] = ["--features", "bootloader/development"];

/// The chip that the images are compiled for where nothing else is said.
pub(crate) const CHIP: &str = "stm32f446";

/// The others. The second is the first with Ethernet and a camera, which the images do not use: the first stands for both where time
/// is short.
pub(crate) const OTHER_CHIPS: [&str; 2] = ["stm32f405", "stm32f407"];

/// Compiles the firmware and the bootloader for development, and says where they are.
pub(crate) fn compile_node(toolchain: &Toolchain, chip: &str) -> Result<PathBuf> {
    if chip != CHIP {
        return compile_for(toolchain, chip);
    }
    compile(toolchain, "firmware 1/2", &["firmware", "bootloader"])?;
    Ok(dir())
}

/// Compiles the firmware and the bootloader for development and for another chip, and puts them into a folder with the chip's name:
/// cargo itself has one place for all.
pub(crate) fn compile_for(toolchain: &Toolchain, chip: &str) -> Result<PathBuf> {
    call_cargo_for(toolchain, "build", chip)?;
    let folder = dir().join(chip);
    std::fs::create_dir_all(&folder)?;
    for name in ["firmware", "bootloader"] {
        std::fs::copy(dir().join(name), folder.join(name))?;
    }
    Ok(folder)
}

/// Whether the firmware and the bootloader compile for another chip.
pub(crate) fn check_for(toolchain: &Toolchain, chip: &str) -> Result<()> {
    call_cargo_for(toolchain, "check", chip)
}

fn call_cargo_for(toolchain: &Toolchain, verb: &str, chip: &str) -> Result<()> {
    let features = ["--no-default-features", "--features", chip];
    let mut command = toolchain.cargo(verb, &["--release", "-p", "firmware", "-p", "bootloader"]);
    progress::build(chip, command.args(features).args(DEVELOPMENT))
}

/// Compiles the application alone, and says where it is.
pub(crate) fn compile_application(toolchain: &Toolchain) -> Result<PathBuf> {
    progress::build("firmware", &mut toolchain.cargo("build", &["--release", "-p", "firmware"]))?;
    Ok(dir().join("firmware"))
}

/// Compiles the bootloader alone, and says where it is: one for development, or one that trusts nothing but this key.
pub(crate) fn compile_bootloader(toolchain: &Toolchain, key: Option<String>) -> Result<PathBuf> {
    let mut command = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    match key {
        Some(key) => command.env(KEYS[0], key).env_remove(KEYS[1]),
        None => command.args(DEVELOPMENT),
    };
    progress::build("bootloader", &mut command)?;
    Ok(dir().join("bootloader"))
}

/// Compiles everything that the tests run on the emulated core, for development.
pub(crate) fn compile_all(toolchain: &Toolchain) -> Result<()> {
    compile(toolchain, "images", &["firmware", "bootloader", "mechanics-images"])
}

/// Compiles the firmware and the bootloader for the owner of the keys in the environment. The owner signs the firmware.
pub(crate) fn build_for_owner() -> Result<()> {
    ensure!(
        std::env::var_os("UPDATE_PUBLIC_KEY").is_some(),
        "the bootloader needs the key of its owner in UPDATE_PUBLIC_KEY; `cargo xtask sign key FILE` makes one. \
         For a board on a desk: cargo xtask images --development"
    );
    let packages = ["--release", "-p", "firmware", "-p", "bootloader"];
    progress::build("images", &mut Toolchain::ensure()?.cargo("build", &packages))?;
    println!("{} is to be signed: cargo xtask sign image", dir().join("firmware").display());
    Ok(())
}

/// Compiles the bootloader as its owner does, with keys that only the tests know, and puts the file beside the one for
/// development.
pub(crate) fn compile_owners(toolchain: &Toolchain) -> Result<PathBuf> {
    let mut command = owners(toolchain)?;
    command.env_remove(AUTHORISATION_KEY);
    put_beside(&mut command, "bootloader-owner")
}

/// The same, for an owner who wants to know who changes the program.
fn compile_guarded(toolchain: &Toolchain) -> Result<PathBuf> {
    let mut command = owners(toolchain)?;
    command.env(AUTHORISATION_KEY, of_tests("authorisation-key.hex")?.trim());
    put_beside(&mut command, "bootloader-guarded")
}

/// How an owner builds the bootloader.
fn owners(toolchain: &Toolchain) -> Result<Command> {
    let mut command = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    command.envs(KEYS.into_iter().zip(of_tests("owner-keys.hex")?.lines()));
    Ok(command)
}

fn of_tests(name: &str) -> Result<String> {
    Ok(std::fs::read_to_string(root().join("host-tests/tests/board/update").join(name))?)
}

fn put_beside(build: &mut Command, name: &str) -> Result<PathBuf> {
    progress::build("bootloader of an owner", build)?;
    let place = dir().join(name);
    std::fs::copy(dir().join("bootloader"), &place)?;
    Ok(place)
}

/// Both; and without a key, and not for development, there is no bootloader.
pub(crate) fn check_owners(toolchain: &Toolchain) -> Result<()> {
    compile_guarded(toolchain)?;
    compile_owners(toolchain)?;
    let mut keyless = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    for key in KEYS {
        keyless.env_remove(key);
    }
    let refused = keyless.output()?;
    let says = String::from_utf8_lossy(&refused.stderr);
    ensure!(
        !refused.status.success() && says.contains("needs a key of its owner"),
        "a bootloader that is not for development was built with the development key:\n{says}"
    );
    Ok(())
}

/// The variables that the keys come in.
const KEYS: [&str; 2] = ["UPDATE_PUBLIC_KEY", "UPDATE_PUBLIC_KEY_2"];
/// The variable of the key that opens a node for an update.
const AUTHORISATION_KEY: &str = "UPDATE_AUTHORISATION_KEY";

fn compile(toolchain: &Toolchain, what: &str, packages: &[&str]) -> Result<()> {
    let mut command = toolchain.cargo("build", &["--release"]);
    command.args(DEVELOPMENT).args(packages.iter().flat_map(|package| ["-p", package]));
    progress::build(what, &mut command)?;
    for name in ["firmware", "bootloader"] {
        ensure!(dir().join(name).exists(), "cargo built no {name} in {}", dir().display());
    }
    Ok(())
}

/// Has the tool make the image that a programmer writes and `nodectl update` takes, signed with the development key.
pub(crate) fn sign(mut tool: Command, images: &Path) -> Result<()> {
    run(tool.arg("image").arg(images.join("firmware")))
}

/// Compiles and signs everything that the tests run on the emulated core.
pub(crate) fn build(tools: Tools) -> Result<()> {
    compile_all(&Toolchain::ensure()?)?;
    sign(tools.get("sign")?, &dir())
}
