//! `cargo xtask release`: checks the sources and makes the files of a release (docs/release.md). The tag, the crate and
//! the page of the release are left to the maintainer, because they cannot be undone.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, ensure};
use clap::Args;
use sha2::{Digest as _, Sha256};
use start::output;

use crate::command::{cargo, line, root, run, target_dir};
use crate::images;
use crate::metadata::RELEASED;

const VERSION: &str = env!("CARGO_PKG_VERSION");

#[derive(Args)]
pub(crate) struct Flags {
    /// Check the sources, and print the steps
    #[arg(long)]
    dry_run: bool,
    /// The secret release key that signs the firmware
    #[arg(long, required_unless_present = "dry_run")]
    key: Option<PathBuf>,
    /// The security counter of the firmware
    #[arg(long, default_value_t = 0)]
    counter: u32,
}

/// Checks the sources; then makes the files, or prints how.
pub(crate) fn make(flags: &Flags) -> Result<()> {
    let mistakes = mistakes()?;
    let folder = target_dir().join(format!("release-{VERSION}"));
    let steps = steps(flags, &folder);
    if flags.dry_run {
        mistakes.iter().for_each(|mistake| println!("not yet: {mistake}"));
        println!("cargo xtask release would run, for version {VERSION}:");
        steps.iter().for_each(|step| println!("  {}", line(step)));
        print_rest(&folder);
        return Ok(());
    }
    ensure!(mistakes.is_empty(), "the sources are no release yet:\n  {}", mistakes.join("\n  "));
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for mut step in steps {
        println!("== {}", line(&step));
        run(&mut step)?;
    }
    let nodectl = format!("nodectl{}", std::env::consts::EXE_SUFFIX);
    fs::copy(target_dir().join("release").join(&nodectl), folder.join(&nodectl))?;
    fs::copy(images::dir().join("bootloader"), folder.join("bootloader.elf"))?;
    for sheet in fs::read_dir(root().join("eds"))?.flatten() {
        fs::copy(sheet.path(), folder.join(sheet.file_name()))?;
    }
    fs::write(folder.join("SHA256SUMS"), checksums(&folder)?)?;
    print_rest(&folder);
    Ok(())
}

/// The reasons against a release of the sources.
fn mistakes() -> Result<Vec<String>> {
    let mut mistakes = Vec::new();
    let changelog = fs::read_to_string(root().join("CHANGELOG.md"))?;
    mistakes.extend(mistake_of(&changelog));
    let git = |arguments: &[&str]| {
        let place = root().display().to_string();
        output("git", &[&["-C", &place], arguments].concat()).context("git does not answer")
    };
    if !git(&["status", "--porcelain"])?.trim().is_empty() {
        mistakes.push("files are not committed".to_owned());
    }
    if !git(&["tag", "--list", &format!("v{VERSION}")])?.trim().is_empty() {
        mistakes.push(format!("the tag v{VERSION} exists: raise the version in Cargo.toml"));
    }
    Ok(mistakes)
}

/// The heading of the version in CHANGELOG.md has its date: `## [0.1.0] - 2026-01-31`.
fn mistake_of(changelog: &str) -> Option<String> {
    let heading = format!("## [{VERSION}]");
    let rest = changelog.lines().find_map(|line| line.strip_prefix(&heading));
    let Some(rest) = rest else {
        return Some(format!("CHANGELOG.md has no heading `{heading}`"));
    };
    let date = rest.trim_start_matches([' ', '-']);
    let is_date = date.len() == 10 && date.chars().all(|c| c.is_ascii_digit() || c == '-');
    (!is_date).then(|| format!("CHANGELOG.md: the heading of {VERSION} has no date"))
}

/// The programs that a release runs.
fn steps(flags: &Flags, folder: &Path) -> Vec<Command> {
    let xtask = |arguments: &[&str]| {
        let mut command = cargo();
        command.arg("xtask").args(arguments);
        command
    };
    let mut sign = xtask(&["sign", "image"]);
    sign.arg(images::dir().join("firmware"));
    sign.arg("--key").arg(flags.key.as_deref().unwrap_or(Path::new("RELEASE.pem")));
    sign.args(["--counter", &flags.counter.to_string(), "--out"]).arg(folder.join("firmware.img"));
    let mut bill = xtask(&["sbom", "--out"]);
    bill.arg(folder);
    let mut nodectl = cargo();
    nodectl.args(["build", "--release", "--locked", "-p", "nodectl", "--features", RELEASED]);
    let mut library = cargo();
    library.args(["package", "--locked", "-p", "canopen-device"]);
    vec![xtask(&["test"]), xtask(&["reproducible"]), xtask(&["images"]), sign, bill, nodectl, library]
}

fn print_rest(folder: &Path) {
    println!("The files are in {}. Left for the maintainer:", folder.display());
    println!("  git tag -s v{VERSION} -m \"Version {VERSION}\" && git push origin v{VERSION}");
    println!("  cargo publish -p canopen-device");
    println!("  gh release upload v{VERSION} {}/*", folder.display());
}

/// The checksums of the files in a folder, as `sha256sum --check` reads them.
fn checksums(folder: &Path) -> Result<String> {
    let mut files: Vec<PathBuf> = fs::read_dir(folder)?.flatten().map(|entry| entry.path()).collect();
    files.retain(|path| path.file_name().is_some_and(|name| name != "SHA256SUMS"));
    files.sort();
    let mut text = String::new();
    for file in files {
        let sum = hex::encode(Sha256::digest(fs::read(&file)?));
        writeln!(text, "{sum}  {}", file.file_name().unwrap_or_default().display())?;
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_version_without_date_is_no_release() {
        assert_eq!(mistake_of(&format!("## [{VERSION}] - 2026-01-31\n")), None);
        let unreleased = mistake_of(&format!("## [{VERSION}] - unreleased\n")).unwrap();
        assert!(unreleased.contains("no date"), "{unreleased}");
        let missing = mistake_of("## [0.0.1] - 2026-01-31\n").unwrap();
        assert!(missing.contains("no heading"), "{missing}");
    }

    #[test]
    fn a_dry_run_names_each_step_once() {
        let flags = Flags { dry_run: true, key: None, counter: 3 };
        let lines: Vec<String> = steps(&flags, Path::new("out")).iter().map(line).collect();
        for part in
            ["xtask test", "reproducible", "xtask images", "--counter 3", "sbom", "nodectl", "package"]
        {
            assert_eq!(lines.iter().filter(|line| line.contains(part)).count(), 1, "{part}: {lines:?}");
        }
        assert!(make(&flags).is_ok());
    }

    #[test]
    fn checksums_are_those_of_sha256sum() {
        let folder = std::env::temp_dir().join(format!("checksums-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        fs::write(folder.join("abc"), "abc").unwrap();
        fs::write(folder.join("SHA256SUMS"), "old").unwrap();
        let sums = checksums(&folder).unwrap();
        fs::remove_dir_all(&folder).unwrap();
        assert_eq!(sums, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  abc\n");
    }
}
