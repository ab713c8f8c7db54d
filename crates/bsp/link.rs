//! Links an image into its region of memory.x. The build scripts of the images take this file in by its path.

use std::path::Path;
use std::{env, fs};

/// Writes the `image.x` that memory.x includes, and tells the linker about both. `region` is where the image lies.
pub(crate) fn image(region: &str) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let common = root.join("crates/bsp/image.x");
    let script = fs::read_to_string(&common).expect("a linker script of the project");
    let script = format!("REGION_ALIAS(\"FLASH\", {region});\n\n{script}");
    let out = env::var("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("image.x"), script).expect("cargo's directory can be written");
    for path in [common, root.join("memory.x"), root.join("crates/bsp/link.rs")] {
        println!("cargo:rerun-if-changed={}", path.display());
    }
    for directory in [Path::new(&out), &root] {
        println!("cargo:rustc-link-search={}", directory.display());
    }
    for argument in ["-Tlink.x", "-Tdefmt.x", "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
