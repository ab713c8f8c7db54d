//! Reads the images as they are flashed: which calls lead to a panic, and how deep the stack can get.
//!
//! Both come from one graph: the instructions are decoded (capstone), and every branch out of a function is a way into
//! another one. A call through a register counts as one of the constant that was put into it; a call through memory is
//! refused, as is recursion, so nothing is left out of the graph unseen.
#![forbid(unsafe_code)]

mod code;
mod graph;
mod image;
mod lists;
mod panics;
mod stack;
mod tasks;

use std::path::Path;

use anyhow::{Context, Result};
use budget::Compiler;

pub use stack::{Bound, Level};

/// The images, as cargo names them.
pub const IMAGES: [&str; 2] = ["firmware", "bootloader"];

/// Prints the known calls that lead to a panic; an error names the others. What is known of a function whose path contains
/// `forget` is forgotten, to show that the check can fail.
pub fn check_panics(images: &Path, forget: Option<&str>) -> Result<()> {
    println!("| image | what can panic | calls | why |\n|---|---|---|---|");
    let known: Vec<_> = lists::KNOWN
        .into_iter()
        .filter(|known| !forget.is_some_and(|forgotten| known.function.contains(forgotten)))
        .collect();
    for name in IMAGES {
        let path = images.join(name);
        let bytes = image::read(&path)?;
        let image = image::Image::parse(&bytes)?;
        let graph = graph::Graph::of(&image).with_context(|| name)?;
        panics::compare(name, &panics::sites(&path, &image, &graph)?, &known, &Compiler::of(&path)?)?;
    }
    Ok(())
}

/// How deep the stack of an image can get.
pub fn stack_bound(images: &Path, name: &str) -> Result<Bound> {
    let bytes = image::read(&images.join(name))?;
    let image = image::Image::parse(&bytes)?;
    let graph = graph::Graph::of(&image).with_context(|| name.to_owned())?;
    stack::bound(&image, &graph, &tasks::of(name)?).with_context(|| name.to_owned())
}
