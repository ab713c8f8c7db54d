//! The ELF files for the Cortex-M4.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};

use crate::command::{root, run, target_dir};
use crate::own_tool::Tools;
use crate::progress;
use crate::target::{TRIPLE, Toolchain};

/// The directory of the ELF files.
pub(crate) fn dir() -> PathBuf {
    target_dir().join(TRIPLE).join("release")
}

/// Images for a board on a desk, emulated or not. The bootloader starts unsigned images, and trusts the development key,
/// which is published in the repository. The application counts more for its self-test, and obeys its commands.
pub(crate) const DEVELOPMENT: [&str; 2] = ["--features", "bootloader/development,firmware/development"];

/// The default chip of the images.
pub(crate) const CHIP: &str = "stm32f446";

/// The other chips, and the features of their boards (crates/bsp/src/boards). The second is the first with Ethernet and
/// a camera, which the images do not use. So the first represents both in quick tests.
pub(crate) const OTHER_CHIPS: [(&str, &str); 2] =
    [("stm32f405", "bsp/weact-f405rg"), ("stm32f407", "bsp/black-f407ve")];

/// The feature of the board with this other chip.
pub(crate) fn other_board(chip: &str) -> Option<&'static str> {
    OTHER_CHIPS.iter().find_map(|(other, board)| (*other == chip).then_some(*board))
}

/// Compiles the firmware and the bootloader for development. Returns their directory.
pub(crate) fn compile_node(toolchain: &Toolchain, chip: &str) -> Result<PathBuf> {
    if chip != CHIP {
        return compile_for(toolchain, chip);
    }
    compile(toolchain, "firmware 1/2", &["firmware", "bootloader"])?;
    Ok(dir())
}

/// Compiles the firmware and the bootloader for development and for another chip, and copies them into a folder with
/// the chip's name, because cargo has one place for all chips.
pub(crate) fn compile_for(toolchain: &Toolchain, chip: &str) -> Result<PathBuf> {
    call_cargo_for(toolchain, "build", chip)?;
    let folder = dir().join(chip);
    std::fs::create_dir_all(&folder)?;
    for name in ["firmware", "bootloader"] {
        std::fs::copy(dir().join(name), folder.join(name))?;
    }
    Ok(folder)
}

/// Checks that the firmware and the bootloader compile for another chip.
pub(crate) fn check_for(toolchain: &Toolchain, chip: &str) -> Result<()> {
    call_cargo_for(toolchain, "check", chip)
}

fn call_cargo_for(toolchain: &Toolchain, verb: &str, chip: &str) -> Result<()> {
    let board = other_board(chip).context("no board has this chip")?;
    let features = ["--no-default-features", "--features", board];
    let mut command = toolchain.cargo(verb, &["--release", "-p", "firmware", "-p", "bootloader"]);
    progress::build(chip, command.args(features).args(DEVELOPMENT))
}

/// Compiles the application alone. Returns its path.
pub(crate) fn compile_application(toolchain: &Toolchain) -> Result<PathBuf> {
    progress::build("firmware", &mut toolchain.cargo("build", &["--release", "-p", "firmware"]))?;
    Ok(dir().join("firmware"))
}

/// Compiles the bootloader alone, with these keys as the only trusted keys, or for development without keys. Returns its
/// path.
pub(crate) fn compile_bootloader(toolchain: &Toolchain, keys: &[String]) -> Result<PathBuf> {
    let mut command = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    for key in KEYS {
        command.env_remove(key);
    }
    command.envs(KEYS.iter().zip(keys));
    if keys.is_empty() {
        command.args(["--features", "development"]);
    }
    progress::build("bootloader", &mut command)?;
    Ok(dir().join("bootloader"))
}

/// Compiles all programs that the tests run on the emulated core, for development.
pub(crate) fn compile_all(toolchain: &Toolchain) -> Result<()> {
    compile(toolchain, "images", &["firmware", "bootloader", "mechanics-images"])
}

/// Compiles the firmware and the bootloader with the keys in the environment. The owner of the keys signs the firmware.
pub(crate) fn build_for_owner() -> Result<()> {
    ensure!(
        KEYS[..2].iter().all(|key| std::env::var_os(key).is_some()),
        "the bootloader needs the keys of its owner in UPDATE_RELEASE_KEY and UPDATE_ROOT_KEY; `cargo xtask sign key FILE` makes one. \
         For a board on a desk: cargo xtask images --development"
    );
    // Apart, as in the tests: together, cargo gives the bootloader the features that the firmware needs.
    let toolchain = Toolchain::ensure()?;
    progress::build("bootloader", &mut toolchain.cargo("build", &["--release", "-p", "bootloader"]))?;
    compile_application(&toolchain)?;
    println!("{} is to be signed: cargo xtask sign image", dir().join("firmware").display());
    Ok(())
}

/// Compiles the bootloader with keys that only the tests know, in the configuration for an owner, and puts the file
/// beside the bootloader for development.
pub(crate) fn compile_owners(toolchain: &Toolchain) -> Result<PathBuf> {
    let mut command = owners(toolchain)?;
    command.env_remove(AUTHORISATION_KEY);
    put_beside(&mut command, "bootloader-owner")
}

/// Compiles the bootloader of an owner whose nodes demand an authorisation for an update.
fn compile_guarded(toolchain: &Toolchain) -> Result<PathBuf> {
    let mut command = owners(toolchain)?;
    command.env(AUTHORISATION_KEY, of_tests("authorisation-key.hex")?.trim());
    put_beside(&mut command, "bootloader-guarded")
}

/// The build of the bootloader in the configuration for an owner.
fn owners(toolchain: &Toolchain) -> Result<Command> {
    let published = ["--features", "bootloader/published-keys"];
    let mut command = toolchain.cargo("build", &["--release", "-p", "bootloader"]);
    command.args(published);
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

/// Checks both bootloaders of owners, and that the build fails without a key and with a published key.
pub(crate) fn check_owners(toolchain: &Toolchain) -> Result<()> {
    compile_guarded(toolchain)?;
    compile_owners(toolchain)?;
    let digits = of_tests("owner-keys.hex")?;
    let (published, secret) = (digits.lines().next(), of_tests("authorisation-key.hex")?);
    // Any key that is not published.
    let own = "42".repeat(32);
    let published = published.unwrap_or_default();
    refuses(toolchain, &[])?;
    refuses(toolchain, &[(KEYS[0], &own)])?;
    refuses(toolchain, &[(KEYS[0], published), (KEYS[1], &own)])?;
    refuses(toolchain, &[(KEYS[0], &own), (KEYS[1], published)])?;
    refuses(toolchain, &[(KEYS[0], &own), (KEYS[1], &own), (KEYS[2], published)])?;
    refuses(toolchain, &[(KEYS[0], &own), (KEYS[1], &own), (AUTHORISATION_KEY, secret.trim())])
}

/// Checks that the bootloader of an owner does not compile with these variables.
fn refuses(toolchain: &Toolchain, variables: &[(&str, &str)]) -> Result<()> {
    let mut build = toolchain.cargo("check", &["--release", "-p", "bootloader"]);
    for key in KEYS {
        build.env_remove(key);
    }
    let refused = build.env_remove(AUTHORISATION_KEY).envs(variables.iter().copied()).output()?;
    let told = String::from_utf8_lossy(&refused.stderr);
    ensure!(
        !refused.status.success() && told.contains("needs a key of its owner"),
        "a bootloader that is not for development was built with {variables:?}:\n{told}"
    );
    Ok(())
}

/// The environment variables with the public keys.
const KEYS: [&str; 3] = ["UPDATE_RELEASE_KEY", "UPDATE_ROOT_KEY", "UPDATE_RECOVERY_KEY"];
/// The environment variable with the key that authorises an update.
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

/// Lets the tool make the image for programmers and `nodectl update`, signed with the development key.
pub(crate) fn sign(mut tool: Command, images: &Path) -> Result<()> {
    run(tool.arg("image").arg(images.join("firmware")))
}

/// Compiles and signs all programs that the tests run on the emulated core.
pub(crate) fn build(tools: Tools) -> Result<()> {
    compile_all(&Toolchain::ensure()?)?;
    sign(tools.get("sign")?, &dir())
}
