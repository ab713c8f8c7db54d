//! Links the image into its region of memory.x.

#[path = "../crates/bsp/link.rs"]
mod link;

fn main() {
    link::image(["APPLICATION", "NODE_RAM"], "link.x");
    println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
}
