//! The graph of calls between functions.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};

use crate::code::{Body, Decoder, Through, Way};
use crate::image::{Function, Image};

/// The functions of an image, by their start.
pub(crate) struct Graph(BTreeMap<u32, Body>);

/// The largest use of the stack below a function, and the functions on the way there.
#[derive(Clone, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Depth {
    pub(crate) bytes: u32,
    /// Start and bytes of each function, the outermost function first.
    pub(crate) path: Vec<(u32, u32)>,
}

impl Graph {
    pub(crate) fn of(image: &Image<'_>) -> Result<Graph> {
        let decoder = Decoder::new()?;
        let bodies = image.functions().map(|function| Ok((function.start, decoder.body(image, function)?)));
        let mut graph = Graph(bodies.collect::<Result<_>>()?);
        graph.follow_callers(image)?;
        Ok(graph)
    }

    /// Adds the ways through a register that only the callers have filled.
    fn follow_callers(&mut self, image: &Image<'_>) -> Result<()> {
        let mut found = Vec::new();
        for function in image.functions() {
            let through = self.0.get(&function.start).into_iter().flat_map(|body| &body.through);
            for branch in through {
                let ways = self.through(image, function, *branch);
                let ways = ways.with_context(|| format!("{:#09x} in {}", branch.at, function.name))?;
                found.extend(ways.into_iter().map(|way| (function.start, way)));
            }
        }
        for (start, way) in found {
            self.0.entry(start).or_default().ways.push(way);
        }
        Ok(())
    }

    /// The ways on from a branch through a register, one for each caller of its function.
    fn through(&self, image: &Image<'_>, function: &Function, branch: Through) -> Result<Vec<Way>> {
        let callers = self.0.values().flat_map(|body| &body.ways).filter(|way| way.to == function.start);
        let ways = callers.map(|caller| {
            let constant = caller.registers.constant(branch.register);
            let to =
                constant.with_context(|| format!("the caller at {:#09x} holds no constant", caller.at))?;
            Ok(Way { at: branch.at, to: image.entered(to)?.start, registers: caller.registers.clone() })
        });
        let ways: Vec<Way> = ways.collect::<Result<_>>()?;
        ensure!(!ways.is_empty(), "calls through a register that holds no constant, and has no caller");
        Ok(ways)
    }

    pub(crate) fn bodies(&self) -> impl Iterator<Item = (u32, &Body)> {
        self.0.iter().map(|(&start, body)| (start, body))
    }

    /// The ways out of this function.
    pub(crate) fn ways(&self, start: u32) -> impl Iterator<Item = &Way> {
        self.0.get(&start).into_iter().flat_map(|body| &body.ways)
    }

    /// The largest use of the stack from this function on. A function that calls itself, directly or not, has none.
    pub(crate) fn depth(&self, image: &Image<'_>, start: u32) -> Result<Depth> {
        self.search(image, start, &mut BTreeMap::new())
    }

    /// The search behind [`depth`](Graph::depth). `None` in `known` stands for a function whose search has not ended.
    fn search(
        &self,
        image: &Image<'_>,
        start: u32,
        known: &mut BTreeMap<u32, Option<Depth>>,
    ) -> Result<Depth> {
        let name = || image.function_at(start).map_or("?", |function| function.name.as_str());
        if let Some(depth) = known.get(&start) {
            return depth.clone().with_context(|| format!("{} calls itself", name()));
        }
        known.insert(start, None);
        let mut below = Depth::default();
        for way in self.ways(start) {
            let other = self.search(image, way.to, known).with_context(|| format!("called by {}", name()))?;
            below = below.max(other);
        }
        let own = self.frame(image, start)?;
        let path = [(start, own)].into_iter().chain(below.path).collect();
        let depth = Depth { bytes: own + below.bytes, path };
        known.insert(start, Some(depth.clone()));
        Ok(depth)
    }

    /// The bytes of stack that a function takes: the larger one of the compiler's note and the sum over the
    /// instructions. The sum is larger where the compiler has later moved out a part of the function and saves a
    /// register around the call.
    pub(crate) fn frame(&self, image: &Image<'_>, start: u32) -> Result<u32> {
        let function = image.function_at(start).context("not in the image")?;
        let body = self.0.get(&start).with_context(|| format!("nothing is known of {}", function.name))?;
        ensure!(
            function.noted.is_some() || !body.is_variable,
            "nothing tells the stack of {}",
            function.name
        );
        Ok(function.noted.unwrap_or(0).max(body.stack))
    }
}
