//! The tools of this machine for building the images.

use std::path::{Path, PathBuf};

use crate::output;
use crate::packages::{Package, is_installed, runs};

/// The target of both images: Cortex-M4 with its FPU.
pub const TRIPLE: &str = "thumbv7em-none-eabihf";

const DEBIAN: [Package; 3] = [Package::DebianRust, Package::DebianRustSource, Package::DebianCargo];

/// Whether the compiler at hand has a core library for the target.
pub fn has_target() -> bool {
    let Some(libdir) = output("rustc", &["--print", "target-libdir", "--target", TRIPLE]) else {
        return false;
    };
    let Ok(entries) = Path::new(&libdir).read_dir() else { return false };
    entries.flatten().any(|entry| entry.file_name().to_string_lossy().starts_with("libcore"))
}

/// The missing packages for the target that only the package manager can install.
pub fn missing() -> Vec<Package> {
    if has_target() {
        return Vec::new();
    }
    if is_closed() && runs("apt-get") {
        let linker = linker().is_none().then_some(Package::DebianLinker);
        return DEBIAN.into_iter().filter(|package| !is_installed(*package)).chain(linker).collect();
    }
    if is_closed() || !runs("rustup") { vec![Package::RustTarget] } else { Vec::new() }
}

/// The missing packages for clippy. Clippy comes with the compiler unless Debian builds for the target.
pub fn missing_lints() -> Vec<Package> {
    let is_debian = !has_target() && is_closed() && runs("apt-get");
    if is_debian && !is_installed(Package::DebianClippy) { vec![Package::DebianClippy] } else { Vec::new() }
}

/// Whether rustup may not download.
pub fn is_closed() -> bool {
    std::env::var("RUSTUP_AUTO_INSTALL").is_ok_and(|value| value == "0")
}

/// rustup's own lld, else the lld of Debian's package.
pub fn linker() -> Option<PathBuf> {
    let sysroot = output("rustc", &["--print", "sysroot"]).unwrap_or_default();
    let hosts = Path::new(&sysroot).join("lib/rustlib").read_dir().into_iter().flatten().flatten();
    let bundled = hosts.map(|host| host.path().join("bin/rust-lld"));
    bundled.chain([PathBuf::from("/usr/lib/llvm-22/bin/ld.lld")]).find(|path| path.exists())
}
