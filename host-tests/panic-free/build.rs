//! Keeps every entry point although no code calls it, and lets the linker accept the undefined functions, except for
//! the one of the panic handler.

fn main() {
    for entry in ["start", "communicate", "fail", "measure", "keep", "index"] {
        println!("cargo:rustc-link-arg=--undefined={entry}");
    }
    for outside in ["send", "room", "read", "program"] {
        println!("cargo:rustc-link-arg=--defsym={outside}=0");
    }
    println!("cargo:rustc-link-arg=--entry=start");
}
