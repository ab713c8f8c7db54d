//! The programs start at reset and have the whole flash. The stack has all remaining RAM, because canopen-rs makes its
//! dictionary there. zencan's dictionary is generated from its description.

use std::path::Path;
use std::{env, fs};

const SCRIPT: &str = "MEMORY { BENCH (rx) : ORIGIN = 0x08000000, LENGTH = 512K\n BENCH_RAM (rwx) : ORIGIN = 0x20006000, LENGTH = 106240 }\nREGION_ALIAS(\"FLASH\", BENCH);\nREGION_ALIAS(\"RAM\", BENCH_RAM);\n_stack_start = ORIGIN(RAM) + LENGTH(RAM);\n";

fn main() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let out = env::var("OUT_DIR").expect("cargo sets OUT_DIR");
    fs::write(Path::new(&out).join("image.x"), SCRIPT).expect("OUT_DIR can be written");
    zencan_build::build_node_from_device_config("NODE", "zencan.toml").expect("zencan.toml is good");
    println!("cargo::rustc-link-search={out}");
    println!("cargo::rustc-link-search={}", root.display());
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rustc-link-arg-bins=--nmagic");
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=zencan.toml");
    println!("cargo::rerun-if-changed={}", root.join("memory.x").display());
}
