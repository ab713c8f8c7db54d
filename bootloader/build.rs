//! Links the image into its region of memory.x, to run from RAM.

#[path = "../crates/bsp/link.rs"]
mod link;

fn main() {
    println!("cargo:rerun-if-changed=bootloader.x");
    link::image(["BOOTLOADER", "LOADER_RAM"], "bootloader.x");
}
