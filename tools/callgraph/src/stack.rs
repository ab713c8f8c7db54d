//! The bound of the stack. The bound is the sum of the start-up or the idle task, the deepest task of each priority,
//! and the bytes that the core pushes at each interrupt.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use anyhow::{Context, Result, ensure};

use crate::graph::{Depth, Graph};
use crate::image::Image;

/// Bytes that the core pushes at an exception: 26 words with the floating-point registers, and one to align the stack
/// (PM0214, 2.3.7).
const EXCEPTION: u32 = 4 * 26 + 4;
/// A handler that does not count, because it has a stack of its own (`bsp::start::fault`).
const HARD_FAULT: &str = "HardFault";
/// RTIC's `main` masks the interrupts, runs `init` in this function, whose last act is to enable them, and calls `idle`
/// (rtic-macros, codegen/main.rs).
const START_UP: &str = "__rtic_init_resources";

/// A part of the bound.
#[derive(Clone, Debug)]
pub struct Level {
    /// The name of the code that runs.
    pub name: String,
    /// Bytes that the code takes, with the bytes that the core pushes before.
    pub bytes: u32,
    /// The functions of the deepest way and the bytes of each, the outermost first.
    pub path: Vec<(String, u32)>,
}

/// The bound of the stack of an image.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The start-up, with the interrupts masked.
    pub start_up: Level,
    /// The levels once the interrupts are enabled, the lowest first. All levels can be on the stack at the same time.
    pub levels: Vec<Level>,
    /// Bytes that the linker reserves for the stack.
    pub reserved: u32,
}

impl Bound {
    /// The bound in bytes.
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

/// Computes the bound.
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

    /// The frame of a function alone, without the functions that it calls.
    fn alone(&self, start: u32) -> Result<Depth> {
        let bytes = self.graph.frame(self.image, start)?;
        Ok(Depth { bytes, path: vec![(start, bytes)] })
    }

    /// The deepest task of each priority, the lowest priority first; then all other handlers in the vectors.
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
