//! The tables: ours beside the others.

use std::fmt;
use std::path::Path;

use anyhow::{Context, Result};
use budget::Compiler;

use crate::operations::{OPERATIONS, operational};
use crate::program::Program;
use crate::sizes::Sizes;

/// CANopenNode's core with four PDOs each way, -Os: text, and RAM as published ("about 6.6 KB").
const PUBLISHED_FLASH: u64 = 19_620;
const PUBLISHED_RAM: u64 = 6_600;

/// What the images are optimised for; all of them are linked with LTO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Optimisation {
    /// opt-level "s", as the firmware is flashed; CANopenNode's -Os.
    Size,
    /// opt-level 2; CANopenNode's -O2.
    Speed,
}

impl Optimisation {
    /// Its name in the markers of the page.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Optimisation::Size => "size",
            Optimisation::Speed => "speed",
        }
    }

    fn options(self) -> [&'static str; 2] {
        match self {
            Optimisation::Size => ["opt-level \"s\"", "-Os"],
            Optimisation::Speed => ["opt-level 2", "-O2"],
        }
    }

    /// CANopenNode's sizes are known for one optimisation only.
    fn published_size(self, bytes: u64) -> Option<u64> {
        (self == Optimisation::Size).then_some(bytes)
    }
}

/// A line: ours, zencan-node, CANopenNode.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) cells: [Option<u64>; 3],
}

/// All that was measured.
pub(crate) struct Report {
    pub(crate) optimisation: Optimisation,
    /// As the compiler names itself.
    pub(crate) compiler: String,
    pub(crate) operations: Vec<Row>,
    pub(crate) sizes: Vec<Row>,
}

impl Report {
    /// Runs the images in a directory.
    pub(crate) fn measure(images: &Path, optimisation: Optimisation) -> Result<Report> {
        let ours = images.join("ours");
        Ok(Report {
            optimisation,
            compiler: format!("rustc {}", Compiler::of(&ours)?.version()),
            operations: operations(&ours, &images.join("zencan"), optimisation)?,
            sizes: sizes(images, optimisation)?,
        })
    }

    /// The lines of both tables.
    pub(crate) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.operations.iter().chain(&self.sizes)
    }
}

fn operations(ours: &Path, zencan: &Path, optimisation: Optimisation) -> Result<Vec<Row>> {
    let mut ours = operational(Program::start(ours)?)?;
    let mut zencan = operational(Program::start(zencan)?)?;
    let mut rows = vec![];
    for operation in &OPERATIONS {
        let mine = operation.measure(&mut ours).with_context(|| operation.name)?;
        let theirs = operation.measure(&mut zencan);
        if let Err(error) = &theirs {
            eprintln!("zencan-node, {}: {error:#}", operation.name);
        }
        let [small, fast] = operation.published;
        let published = if optimisation == Optimisation::Size { small } else { fast };
        rows.push(Row { name: operation.name, cells: [Some(mine), theirs.ok(), published] });
    }
    Ok(rows)
}

fn sizes(images: &Path, optimisation: Optimisation) -> Result<Vec<Row>> {
    let empty = Sizes::of(&images.join("empty"))?;
    let ours = Sizes::of(&images.join("ours"))?.without(empty);
    let zencan = Sizes::of(&images.join("zencan"))?.without(empty);
    let row = |name, size: fn(Sizes) -> u64, published: Option<u64>| {
        let published = published.and_then(|bytes| optimisation.published_size(bytes));
        Row { name, cells: [Some(size(ours)), Some(size(zencan)), published] }
    };
    Ok(vec![
        row("instructions", |sizes| sizes.code, None),
        row("constants, the dictionary among them", |sizes| sizes.constants, None),
        row("flash in all", Sizes::flash, Some(PUBLISHED_FLASH)),
        row("RAM without the stack", Sizes::ram, Some(PUBLISHED_RAM)),
    ])
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [ours, published] = self.optimisation.options();
        writeln!(f, "Instructions; {} with {ours} and LTO, CANopenNode with {published}:\n", self.compiler)?;
        table(f, "operation", &self.operations)?;
        writeln!(f, "\nBytes of the protocol core with all its services, four PDOs each way:\n")?;
        table(f, "size", &self.sizes)
    }
}

fn table(f: &mut fmt::Formatter<'_>, first: &str, rows: &[Row]) -> fmt::Result {
    writeln!(f, "| {first} | ours | zencan-node | CANopenNode |\n|---|---:|---:|---:|")?;
    for Row { name, cells } in rows {
        let [ours, zencan, published] =
            cells.map(|cell| cell.map_or("n/a".into(), |number| number.to_string()));
        writeln!(f, "| {name} | {ours} | {zencan} | {published} |")?;
    }
    Ok(())
}
