//! The bound of the stack: the start-up or the idle task, below it one task of each priority at its deepest, and between them
//! what the core pushes at an interrupt.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use anyhow::{Context, Result, ensure};

use crate::graph::{Depth, Graph};
use crate::image::Image;

/// What the core pushes at an exception: 26 words with the floating-point registers, and one to align it (PM0214, 2.3.7).
const EXCEPTION: u32 = 4 * 26 + 4;
/// It has a stack of its own (`bsp::hardware::fault`).
const HARD_FAULT: &str = "HardFault";
/// RTIC's `main` masks the interrupts, runs `init` in this function, whose last act is to enable them, and calls `idle`
/// (rtic-macros, codegen/main.rs).
const START_UP: &str = "__rtic_init_resources";

/// A part of the bound.
#[derive(Clone, Debug)]
pub struct Level {
    /// What runs.
    pub name: String,
    /// What it takes, with what the core pushes before it.
    pub bytes: u32,
    /// The functions of the deepest way and what each takes, the outermost first.
    pub path: Vec<(String, u32)>,
}

/// How deep the stack can get.
#[derive(Clone, Debug)]
pub struct Bound {
    /// While the interrupts are masked.
    pub start_up: Level,
    /// Where the interrupts are not masked: the lowest first, all of them on top of each other.
    pub levels: Vec<Level>,
    /// What the linker keeps for it.
    pub reserved: u32,
}

impl Bound {
    /// Bytes.
    #[must_use]
    pub fn bytes(&self) -> u32 {
        self.levels.iter().map(|level| level.bytes).sum::<u32>().max(self.start_up.bytes)
    }
}

impl fmt::Display for Bound {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for Level { name, bytes, .. } in [&self.start_up].into_iter().chain(&self.levels) {
            writeln!(f, "{bytes:>8}  {name}")?;
        }
        write!(f, "{:>8}  bound, of {} bytes reserved", self.bytes(), self.reserved)
    }
}

/// Adds it up.
pub(crate) fn bound(image: &Image<'_>, graph: &Graph, tasks: &BTreeMap<&str, u8>) -> Result<Bound> {
    let analysis = Analysis { image, graph };
    let mut levels = vec![analysis.thread()?];
    levels.extend(analysis.handlers(tasks)?);
    let start_up = analysis.level("start-up, interrupts masked".into(), 0, analysis.depth("Reset")?);
    let reserved = image.symbol("_stack_start")? - image.symbol("_stack_end")?;
    Ok(Bound { start_up, levels, reserved })
}

struct Analysis<'a> {
    image: &'a Image<'a>,
    graph: &'a Graph,
}

impl Analysis<'_> {
    fn depth(&self, name: &str) -> Result<Depth> {
        self.graph.depth(self.image, self.image.function(name)?.start)
    }

    fn level(&self, name: String, pushed: u32, depth: Depth) -> Level {
        let function = |start| self.image.function_at(start).map_or("?", |function| function.name.as_str());
        let path = depth.path.into_iter().map(|(start, bytes)| (function(start).to_owned(), bytes)).collect();
        Level { name, bytes: pushed + depth.bytes, path }
    }

    /// The stack that is in use when the interrupts are enabled, or that `idle` takes.
    fn thread(&self) -> Result<Level> {
        let main = self.image.function("main")?.start;
        let called = || self.graph.ways(main).map(|way| way.to);
        let is_start_up =
            |start| self.image.function_at(start).is_some_and(|function| function.name.contains(START_UP));
        let start_up = called().find(|&start| is_start_up(start));
        let start_up = start_up.with_context(|| format!("main does not call {START_UP}"))?;
        let mut deepest = self.alone(start_up)?;
        for start in called().filter(|&start| start != start_up) {
            deepest = deepest.max(self.graph.depth(self.image, start)?);
        }
        let Depth { bytes, path } = self.alone(main)?;
        let path = path.into_iter().chain(deepest.path).collect();
        Ok(self.level(
            "idle, or the end of the start-up".into(),
            0,
            Depth { bytes: bytes + deepest.bytes, path },
        ))
    }

    /// A function that calls nothing at that moment.
    fn alone(&self, start: u32) -> Result<Depth> {
        let bytes = self.graph.frame(self.image, start)?;
        Ok(Depth { bytes, path: vec![(start, bytes)] })
    }

    /// Of each priority the deepest task, the lowest priority first; then whatever else is in the vectors.
    fn handlers(&self, tasks: &BTreeMap<&str, u8>) -> Result<Vec<Level>> {
        let starts = |name: &&str| Ok(self.image.function(name)?.start);
        let known: BTreeSet<u32> = tasks.keys().chain([&HARD_FAULT]).map(starts).collect::<Result<_>>()?;
        let vectors = self.image.handlers()?;
        ensure!(known.is_subset(&vectors), "a task is in no vector");
        let unexpected = vectors.difference(&known).map(|&start| (u8::MAX, "unexpected".to_owned(), start));
        let mut handlers: Vec<_> = unexpected.collect();
        for (name, &priority) in tasks {
            let start = self.image.function(name)?.start;
            handlers.push((priority, format!("priority {priority}, {name}"), start));
        }
        let mut levels: BTreeMap<u8, Level> = BTreeMap::new();
        for (priority, name, start) in handlers {
            let level = self.level(name, EXCEPTION, self.graph.depth(self.image, start)?);
            if levels.get(&priority).is_none_or(|deepest| deepest.bytes < level.bytes) {
                levels.insert(priority, level);
            }
        }
        Ok(levels.into_values().collect())
    }
}
