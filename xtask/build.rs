//! Passes the triple of this machine to xtask.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rustc-env=XTASK_HOST={}", std::env::var("HOST").expect("cargo sets HOST"));
}
