//! Links an image into its region of memory.x. The build scripts of the images include this file by its path.

use std::path::Path;
use std::{env, fs};

/// Writes the `image.x` that memory.x includes, and passes both to the linker. The regions are those of the image in
/// flash and in RAM; `script` is the script of cortex-m-rt, or one in the directory of the image.
pub(crate) fn image([flash, ram]: [&str; 2], script: &str) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = here.join("..");
    let common = root.join("crates/bsp/image.x");
    let text = fs::read_to_string(&common).expect("a linker script of the project");
    let text = format!("REGION_ALIAS(\"FLASH\", {flash});\nREGION_ALIAS(\"RAM\", {ram});\n\n{text}");
    let out = env::var("OUT_DIR").expect("cargo sets it");
    fs::write(Path::new(&out).join("image.x"), text).expect("cargo's directory can be written");
    for path in [common, root.join("memory.x"), root.join("crates/bsp/link.rs")] {
        println!("cargo:rerun-if-changed={}", path.display());
    }
    for directory in [Path::new(&out), &root, here] {
        println!("cargo:rustc-link-search={}", directory.display());
    }
    for argument in [&format!("-T{script}"), "--nmagic"] {
        println!("cargo:rustc-link-arg-bins={argument}");
    }
}
