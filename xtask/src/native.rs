//! Programs and libraries of the system: installed where this user may, else named.

use std::path::Path;
use std::process::{Command, Stdio};

use anyhow::{Result, bail};

use crate::command::{exists, output, run};

/// Sees to it that the emulator's CPU library can be built: it needs cmake and libclang.
pub(crate) fn ensure_emulator_tools() -> Result<()> {
    let mut missing = Vec::new();
    if !exists("cmake") {
        missing.push("cmake");
    }
    if !has_libclang() {
        missing.push("libclang-dev");
    }
    ensure_packages(&missing, "the emulator's CPU library is built with them")
}

/// Sees to it that there is a tshark to judge what was said on the bus.
pub(crate) fn ensure_tshark() -> Result<()> {
    let missing: &[&str] = if exists("tshark") { &[] } else { &["tshark"] };
    ensure_packages(missing, "the tests have it decode what was said on the bus")
}

/// Installs Debian packages as root; for anyone else prints the one command that does it, and stops.
pub(crate) fn ensure_packages(packages: &[&str], reason: &str) -> Result<()> {
    if packages.is_empty() {
        return Ok(());
    }
    let names = packages.join(" ");
    if !exists("apt-get") {
        bail!(
            "missing: {names} ({reason}); install them with your system's package manager and run this again"
        );
    }
    if output("id", &["-u"]).as_deref() != Some("0") {
        bail!(
            "missing: {names} ({reason}); run this, then try again:\n\n    sudo apt-get install -y {names}\n"
        );
    }
    eprintln!("installing {names}: {reason}");
    run(apt_get().arg("update"))?;
    run(apt_get().args(["install", "-y", "--no-install-recommends"]).args(packages))
}

/// Which of these Debian packages are not installed.
pub(crate) fn missing_packages<'a>(packages: &[&'a str]) -> Vec<&'a str> {
    packages.iter().copied().filter(|name| !installed(name)).collect()
}

fn installed(package: &str) -> bool {
    output("dpkg-query", &["-W", "-f", "${Status}", package])
        .is_some_and(|status| status.ends_with("ok installed"))
}

fn apt_get() -> Command {
    let mut command = Command::new("apt-get");
    command.env("DEBIAN_FRONTEND", "noninteractive").arg("-qq").stdout(Stdio::null());
    command
}

/// Looks where clang-sys, which loads libclang, looks.
fn has_libclang() -> bool {
    let of_llvm = output("llvm-config", &["--libdir"]);
    let usual =
        ["/usr/lib", "/usr/local/lib", "/usr/lib64", "/opt/homebrew/opt/llvm/lib", "/Library/Developer"];
    std::env::var_os("LIBCLANG_PATH").is_some()
        || of_llvm.iter().map(String::as_str).chain(usual).any(|dir| holds_libclang(Path::new(dir), 2))
}

fn holds_libclang(dir: &Path, depth: u32) -> bool {
    let Ok(entries) = dir.read_dir() else { return false };
    entries.flatten().any(|entry| {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        name.starts_with("libclang.")
            || name.starts_with("libclang-") && name.contains(".so")
            || depth > 0
                && (name.starts_with("llvm") || name == "lib" || name.ends_with("-linux-gnu"))
                && holds_libclang(&entry.path(), depth - 1)
    })
}
