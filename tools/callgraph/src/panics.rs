//! The calls that lead to a panic, compared with the list of known calls.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::Path;

use crate::budget::Compiler;
use addr2line::Loader;
use anyhow::{Result, anyhow, ensure};

use crate::graph::Graph;
use crate::image::Image;
use crate::lists::{Known, WIDTH};

/// The sources of the core library, wherever they lie.
const CORE: &str = "/library/core/src/";
/// Name prefix of functions that the compiler has made of code that several functions share.
const OUTLINED: &str = "OUTLINED_FUNCTION_";
/// The panic handler.
const HANDLER: &str = "__rustc::rust_begin_unwind";

/// A function of the source and a place in it. An address has several frames where functions are inlined.
struct Frame {
    function: String,
    file: String,
    line: u32,
}

/// A call that leads to a panic, in code outside of the core library.
pub(crate) struct Site {
    at: u32,
    /// The frames of the call, the innermost first.
    frames: Vec<Frame>,
}

impl Site {
    /// The innermost function outside of the core library.
    pub(crate) fn function(&self) -> &str {
        let own = self.frames.iter().find(|frame| !frame.file.contains(CORE)).or(self.frames.first());
        own.map_or("?", |frame| frame.function.trim_start_matches(['<', '&']))
    }

    fn is(&self, known: &Known) -> bool {
        self.function().starts_with(known.function)
    }
}

impl fmt::Display for Site {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:#010x}", self.at)?;
        self.frames
            .iter()
            .try_for_each(|Frame { function, file, line }| write!(f, "\n    in {function}, {file}:{line}"))
    }
}

/// Every such call of an image. There are none where nothing can panic: the linker leaves out a panic handler that is
/// not called.
pub(crate) fn sites(path: &Path, image: &Image<'_>, graph: &Graph) -> Result<Vec<Site>> {
    let loader = Loader::new(path).map_err(|error| anyhow!("{}: {error}", path.display()))?;
    let panics = panics(image, graph, &loader)?;
    let mut sites = vec![];
    for (_, body) in graph.bodies().filter(|(start, _)| !panics.contains(start)) {
        for way in body.ways.iter().filter(|way| panics.contains(&way.to)) {
            sites.push(Site { at: way.at, frames: frames(&loader, way.at)? });
        }
    }
    Ok(sites)
}

/// All functions between the code that can panic and the handler: functions of the core library that call the handler,
/// directly or not.
fn panics(image: &Image<'_>, graph: &Graph, loader: &Loader) -> Result<BTreeSet<u32>> {
    let mut between = BTreeSet::new();
    let mut panics = BTreeSet::new();
    for function in image.functions() {
        let outermost = frames(loader, function.start)?.pop();
        if function.name.starts_with(OUTLINED) || outermost.is_some_and(|frame| frame.file.contains(CORE)) {
            between.insert(function.start);
        }
        if function.name.starts_with("core::panicking::") || function.name == HANDLER {
            panics.insert(function.start);
        }
    }
    loop {
        let leads = |start: &u32| graph.ways(*start).any(|way| panics.contains(&way.to));
        let more: Vec<u32> =
            between.iter().copied().filter(|start| !panics.contains(start) && leads(start)).collect();
        if more.is_empty() {
            return Ok(panics);
        }
        panics.extend(more);
    }
}

fn frames(loader: &Loader, address: u32) -> Result<Vec<Frame>> {
    let mut found =
        loader.find_frames(address.into()).map_err(|error| anyhow!("{address:#010x}: {error}"))?;
    let mut frames = vec![];
    while let Some(frame) = found.next()? {
        let name = frame.function.and_then(|name| name.demangle().ok().map(String::from));
        let place = frame.location;
        frames.push(Frame {
            function: name.unwrap_or_else(|| "?".into()),
            file: place.as_ref().and_then(|place| place.file).unwrap_or("?").into(),
            line: place.and_then(|place| place.line).unwrap_or(0),
        });
    }
    Ok(frames)
}

/// Prints the known calls and their number, which may be 0 with another compiler. An error names every call that is not
/// known. Another compiler than the one of the list may leave a few unknown calls.
pub(crate) fn compare(name: &str, sites: &[Site], known: &[Known], compiler: &Compiler) -> Result<()> {
    let known: Vec<&Known> = known.iter().filter(|known| known.image == name).collect();
    let mut counts: BTreeMap<&str, usize> = known.iter().map(|known| (known.function, 0)).collect();
    let mut unknown = vec![];
    for site in sites {
        match known.iter().find(|known| site.is(known)) {
            Some(known) => *counts.entry(known.function).or_default() += 1,
            None => unknown.push(format!("\n{site}")),
        }
    }
    for Known { function, reason, .. } in &known {
        println!("| {name} | `{function}` | {} | {reason} |", counts[function]);
    }
    let width = if compiler.is_measured() { 0 } else { WIDTH };
    let text = unknown.concat();
    ensure!(
        unknown.len() <= width,
        "{name}: calls that lead to a panic and are not known, with rustc {compiler}:{text}"
    );
    if !unknown.is_empty() {
        println!("{name}: not known, and tolerated with rustc {compiler}:{text}");
    }
    Ok(())
}
