//! Reads the flashed images: which calls lead to a panic, and how deep the stack can get.
//!
//! Both answers come from one graph. The instructions are decoded (capstone), and every branch out of a function is a
//! way into another function. A call through a register counts as a call of the constant that was put into the
//! register. A call through memory is refused, as is recursion, so that the graph is never incomplete without notice.
#![forbid(unsafe_code)]

pub mod budget;
mod code;
mod errata;
mod graph;
mod image;
mod lists;
mod panics;
mod registers;
mod stack;
mod tasks;

use std::path::Path;

use crate::budget::Compiler;
use anyhow::{Context, Result};

pub use stack::{Bound, Level};

/// The images, as cargo names them.
pub const IMAGES: [&str; 2] = ["firmware", "bootloader"];

/// Prints the known calls that lead to a panic; an error names the others. Entries for functions whose path contains
/// `forget` are ignored, to show that the check can fail.
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

/// The places in an image that an erratum of the chip forbids, one line each: WFI at an unsafe address, and interrupt
/// handlers that return right after a store.
pub fn errata(images: &Path, name: &str) -> Result<Vec<String>> {
    let bytes = image::read(&images.join(name))?;
    errata::places(&image::Image::parse(&bytes)?, &tasks::of(name)?).with_context(|| name.to_owned())
}

/// The bound of the stack of an image.
pub fn stack_bound(images: &Path, name: &str) -> Result<Bound> {
    let bytes = image::read(&images.join(name))?;
    let image = image::Image::parse(&bytes)?;
    let graph = graph::Graph::of(&image).with_context(|| name.to_owned())?;
    stack::bound(&image, &graph, &tasks::of(name)?).with_context(|| name.to_owned())
}
