//! Links the programs at the bootloader's place in memory.x: they start at reset and are small.

use std::path::Path;
use std::{env, fs};

const SCRIPT: &str = "REGION_ALIAS(\"FLASH\", BOOTLOADER);\nREGION_ALIAS(\"RAM\", LOADER_RAM);\n_stack_start = ORIGIN(STACK) + LENGTH(STACK);\n_stack_end = ORIGIN(STACK);\n";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    fs::write(Path::new(&out).join("image.x"), SCRIPT).expect("OUT_DIR can be written");
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-search={}", root.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={}", root.join("memory.x").display());
}
