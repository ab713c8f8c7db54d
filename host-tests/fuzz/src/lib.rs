//! Fuzz targets. Each takes any bytes, makes of them what the outside world could do, and panics when a rule is broken.
//!
//! `cargo xtask fuzz TARGET` lets libFuzzer look for such bytes; the tests replay the corpus that it has found, and
//! some thousand inputs by chance, the same at every run.

pub mod codecs;
pub mod image;
pub mod node;
pub mod pages;
pub mod sheet;

/// One target.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// Its name, and that of its folder in the corpus.
    pub name: &'static str,
    /// What it does with an input.
    pub run: fn(&[u8]),
}

/// All of them.
pub const TARGETS: [Target; 5] = [
    Target { name: "node", run: node::run },
    Target { name: "codecs", run: codecs::run },
    Target { name: "pages", run: pages::run },
    Target { name: "image", run: image::run },
    Target { name: "sheet", run: sheet::run },
];
