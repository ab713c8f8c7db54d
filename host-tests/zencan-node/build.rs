//! Generates the dictionary from the description of the node that `cargo xtask bench` measures.

use std::path::Path;

fn main() {
    let description = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bench/zencan.toml");
    zencan_build::build_node_from_device_config("NODE", &description).expect("zencan.toml is good");
    println!("cargo::rerun-if-changed={}", description.display());
    println!("cargo::rerun-if-changed=build.rs");
}
