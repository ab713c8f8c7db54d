//! The tables: our figures beside those of other libraries.

use std::fmt;
use std::path::Path;

use anyhow::{Context, Result};
use callgraph::budget::Compiler;

use crate::bench::client::Client;
use crate::bench::operations::{OPERATIONS, Operation, operational};
use crate::bench::program::Program;
use crate::bench::sizes::Sizes;

/// CANopenNode's core with four PDOs each way, -Os: text, and RAM as published ("about 6.6 KB").
const PUBLISHED_FLASH: u64 = 19_620;
const PUBLISHED_RAM: u64 = 6_600;

/// The optimisation of the images; all images are linked with LTO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Optimisation {
    /// opt-level "s", as the firmware is flashed; CANopenNode's -Os.
    Size,
    /// opt-level 2; CANopenNode's -O2.
    Speed,
}

impl Optimisation {
    /// The name of the optimisation in the markers of the page.
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

/// The other libraries that are measured: the name of the image, and of the library.
const OTHERS: [(&str, &str); 2] = [("zencan", "zencan-node"), ("canopen-rs", "canopen-rs")];

/// Our devices with fewer services: the name of the row, the image, and CANopenNode's flash.
pub(crate) const DEVICES: [(&str, &str, Option<u64>); 4] = [
    ("flash, minimal device", "minimal", None),
    ("flash, CANopenNode's set", "set", Some(PUBLISHED_FLASH)),
    ("flash, all services", "ours", None),
    ("flash, services only", "services", None),
];

/// The rows of the same devices on a Cortex-M0+.
const SMALL_DEVICES: [&str; DEVICES.len()] = [
    "flash, minimal device, Cortex-M0+",
    "flash, CANopenNode's set, Cortex-M0+",
    "flash, all services, Cortex-M0+",
    "flash, services only, Cortex-M0+",
];

/// A line of a table: our figure, those of [`OTHERS`], and CANopenNode's.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Row {
    pub(crate) name: &'static str,
    pub(crate) cells: [Option<u64>; OTHERS.len() + 2],
}

/// All measured figures.
pub(crate) struct Report {
    pub(crate) optimisation: Optimisation,
    /// The compiler's name and version, as the compiler prints them.
    pub(crate) compiler: String,
    pub(crate) operations: Vec<Row>,
    pub(crate) sizes: Vec<Row>,
}

impl Report {
    /// Runs the images in a directory and measures them.
    pub(crate) fn measure(images: &Path, small: Option<&Path>, optimisation: Optimisation) -> Result<Report> {
        let ours = images.join("ours");
        Ok(Report {
            optimisation,
            compiler: format!("rustc {}", Compiler::of(&ours)?.version()),
            operations: operations(images, optimisation)?,
            sizes: sizes(images, small, optimisation)?,
        })
    }

    /// The lines of both tables that have a figure of ours, and how much worse than stated it may be, in per cent: a
    /// harmless change moves instructions by a few per cent, and sizes by less.
    pub(crate) fn rows(&self) -> impl Iterator<Item = (&Row, u64)> {
        let operations = self.operations.iter().map(|row| (row, 5));
        let sizes = self.sizes.iter().map(|row| (row, 1));
        operations.chain(sizes).filter(|(row, _)| row.cells[0].is_some())
    }
}

fn operations(images: &Path, optimisation: Optimisation) -> Result<Vec<Row>> {
    let start = |image: &str| operational(Program::start(&images.join(image))?);
    let mut ours = start("ours")?;
    let mut others = [start(OTHERS[0].0)?, start(OTHERS[1].0)?];
    let mut rows = vec![];
    for operation in &OPERATIONS {
        let mine = operation.measure(&mut ours).with_context(|| operation.name)?;
        let mut theirs =
            OTHERS.iter().zip(&mut others).map(|((_, name), client)| measure(operation, name, client));
        let (zencan, canopen_rs) = (theirs.next().flatten(), theirs.next().flatten());
        let [small, fast] = operation.published;
        let published = if optimisation == Optimisation::Size { small } else { fast };
        rows.push(Row { name: operation.name, cells: [Some(mine), zencan, canopen_rs, published] });
    }
    Ok(rows)
}

/// The instructions of the operation in another library; `None` when the library cannot do the operation.
fn measure(operation: &Operation, name: &str, client: &mut Client) -> Option<u64> {
    let taken = operation.measure(client);
    if let Err(error) = &taken {
        eprintln!("{name}, {}: {error:#}", operation.name);
    }
    // A library that never reads the time executes no instruction for a pass of time: no figure.
    taken.ok().filter(|&instructions| instructions > 0)
}

fn sizes(images: &Path, small: Option<&Path>, optimisation: Optimisation) -> Result<Vec<Row>> {
    let empty = Sizes::of(&images.join("empty"))?;
    let size_of = |image: &str| Sizes::of(&images.join(image)).map(|size| size.without(empty));
    let [zencan, canopen_rs] = OTHERS.map(|(image, _)| size_of(image));
    let nodes = [size_of("ours")?, zencan?, canopen_rs?];
    let row = |name, size: fn(Sizes) -> u64, published: Option<u64>| {
        let published = published.and_then(|bytes| optimisation.published_size(bytes));
        let [ours, zencan, canopen_rs] = nodes.map(|node| Some(size(node)));
        Row { name, cells: [ours, zencan, canopen_rs, published] }
    };
    let mut rows = vec![
        row("instructions", |sizes| sizes.code, None),
        row("constants, the dictionary among them", |sizes| sizes.constants, None),
        row("flash in all", Sizes::flash, Some(PUBLISHED_FLASH)),
        row("RAM without the stack", Sizes::ram, Some(PUBLISHED_RAM)),
    ];
    for (name, image, published) in DEVICES {
        let published = published.and_then(|bytes| optimisation.published_size(bytes));
        rows.push(Row { name, cells: [Some(size_of(image)?.flash()), None, None, published] });
    }
    for ((_, image, _), name) in DEVICES.iter().zip(SMALL_DEVICES) {
        let size = |small: &Path| -> Result<u64> {
            let empty = Sizes::of(&small.join("empty"))?;
            Ok(Sizes::of(&small.join(image))?.without(empty).flash())
        };
        rows.push(Row { name, cells: [small.map(size).transpose()?, None, None, None] });
    }
    Ok(rows)
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
    let [zencan, canopen_rs] = OTHERS.map(|(_, name)| name);
    writeln!(f, "| {first} | ours | {zencan} | {canopen_rs} | CANopenNode |\n|---|---:|---:|---:|---:|")?;
    for Row { name, cells } in rows {
        let cells = cells.map(|cell| cell.map_or("n/a".into(), |number| number.to_string()));
        writeln!(f, "| {name} | {} |", cells.join(" | "))?;
    }
    Ok(())
}
