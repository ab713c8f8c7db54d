//! Fuzz targets. Each target derives the actions of the outside world from arbitrary bytes, and panics when a rule is
//! broken.
//!
//! With `cargo xtask fuzz TARGET`, libFuzzer searches for such bytes. The tests replay the corpus of the searches and
//! some thousand random inputs, the same at every run.

pub mod codecs;
pub mod image;
pub mod node;
pub mod pages;
pub mod sheet;

/// A fuzz target.
#[derive(Clone, Copy, Debug)]
pub struct Target {
    /// The name of the target and of its folder in the corpus.
    pub name: &'static str,
    /// Runs the target with an input.
    pub run: fn(&[u8]),
}

/// All targets.
pub const TARGETS: [Target; 5] = [
    Target { name: "node", run: node::run },
    Target { name: "codecs", run: codecs::run },
    Target { name: "pages", run: pages::run },
    Target { name: "image", run: image::run },
    Target { name: "sheet", run: sheet::run },
];
