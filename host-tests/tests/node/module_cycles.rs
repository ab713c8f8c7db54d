//! No two modules of different folders depend on each other, directly or through a third module, so that the effects of
//! a change are known. In the CANopen library, this is true for the files beside `lib.rs` too. The dependencies are read
//! from the `use` lines of every crate. A name that `lib.rs` re-exports counts as one of its module; a re-export
//! (`pub use`) of a folder is no dependency.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

const CRATES: [&str; 17] = [
    "bootloader",
    "crates/bsp",
    "crates/node",
    "crates/profiles",
    "crates/storage",
    "crates/update",
    "emulator/canbus",
    "emulator/chip",
    "emulator/core",
    "emulator/sim",
    "emulator/workbench",
    "firmware",
    "tools/bringup",
    "tools/callgraph",
    "tools/eds",
    "tools/programmer",
    "xtask",
];
/// Crates with a folder for each command, which knows the folder around it.
const COMMANDS: [&str; 1] = ["tools/nodectl"];
/// Crates in which no two files beside `lib.rs` depend on each other either.
const LAYERED: [&str; 1] = ["crates/canopen"];

/// Folders, or files beside `lib.rs`, with the folders that each of them uses.
type Graph = BTreeMap<String, BTreeSet<String>>;

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// The paths of a use tree, each with its prefix.
fn expand(tree: &str, before: &str, paths: &mut Vec<String>) {
    let Some((prefix, rest)) = tree.split_once('{') else {
        return paths.push(format!("{before}{}", tree.trim()));
    };
    let inside = rest.trim_end().strip_suffix('}').expect("a brace is closed");
    let before = format!("{before}{}", prefix.trim());
    let (mut depth, mut start) = (0, 0);
    for (at, character) in inside.char_indices().chain([(inside.len(), ',')]) {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                let part = inside[start..at].trim();
                if !part.is_empty() {
                    expand(part, &before, paths);
                }
                start = at + 1;
            }
            _ => (),
        }
    }
}

/// The paths that a file uses from its own crate, from the root of the crate.
fn used(text: &str, module: &[String]) -> Vec<Vec<String>> {
    let code = text.split("#[cfg(test)]").next().unwrap_or(text);
    let mut paths = Vec::new();
    for statement in code.split(';') {
        let line = statement.rfind("\nuse ").map(|at| &statement[at + 1..]);
        let line = line.or_else(|| statement.strip_prefix("use ").map(|_| statement));
        let line = line.or_else(|| statement.rfind("    use ").map(|at| statement[at..].trim_start()));
        if let Some(tree) = line.and_then(|line| line.strip_prefix("use ")) {
            expand(tree, "", &mut paths);
        }
    }
    paths.iter().filter_map(|path| from_root(path, module)).collect()
}

fn from_root(path: &str, module: &[String]) -> Option<Vec<String>> {
    let mut segments = path.split("::").map(str::trim);
    let mut root = match segments.next()? {
        "crate" => Vec::new(),
        "super" => module[..module.len().checked_sub(1)?].to_vec(),
        "self" => module.to_vec(),
        _ => return None,
    };
    for segment in segments {
        if segment == "super" {
            root.pop()?;
        } else {
            root.push(segment.to_string());
        }
    }
    Some(root)
}

/// The folder of a module; a file beside `lib.rs` counts as a folder.
fn folder_of(path: &[String], source: &Path) -> Option<String> {
    let mut folder: Vec<&str> = Vec::new();
    for segment in path {
        let here = source.join(folder.join("/")).join(segment);
        let is_file = here.with_extension("rs").exists();
        if here.is_dir() && !(is_file && folder.is_empty() && path.len() == 1) {
            folder.push(segment);
        } else {
            return match (folder.is_empty(), is_file) {
                (true, true) => Some(segment.clone()),
                (true, false) => None,
                (false, _) => Some(folder.join("/")),
            };
        }
    }
    (!folder.is_empty()).then(|| folder.join("/"))
}

/// The names that `lib.rs` re-exports, each with the path from which they come.
fn re_exported(source: &Path) -> BTreeMap<String, Vec<String>> {
    let text = fs::read_to_string(source.join("lib.rs")).unwrap_or_default();
    let mut paths = Vec::new();
    for statement in text.split(';') {
        if let Some(at) = statement.rfind("\npub use ") {
            expand(&statement[at + "\npub use ".len()..], "", &mut paths);
        }
    }
    let split = |path: String| path.split("::").map(String::from).collect::<Vec<_>>();
    paths.into_iter().map(split).filter_map(|path| Some((path.last()?.clone(), path))).collect()
}

fn graph(source: &Path) -> Graph {
    let mut found = Vec::new();
    files(source, &mut found);
    let re_exported = re_exported(source);
    let origin = |path: &Vec<String>| match path.as_slice() {
        [name] => re_exported.get(name).unwrap_or(path).clone(),
        _ => path.clone(),
    };
    let mut graph = Graph::new();
    for file in found {
        let inside = file.strip_prefix(source).unwrap().with_extension("");
        let mut module: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        let name = module.last().unwrap().clone();
        if matches!(name.as_str(), "lib" | "main" | "tests") {
            continue;
        }
        if name == "mod" {
            module.pop();
        }
        let Some(own) = folder_of(&module, source) else { continue };
        let uses = used(&fs::read_to_string(&file).unwrap(), &module);
        let others = uses.iter().map(origin).filter_map(|path| folder_of(&path, source));
        let others = others.filter(|other| *other != own);
        graph.entry(own.clone()).or_default().extend(others);
    }
    graph
}

/// All folders that a folder depends on, directly or through others.
fn needs<'a>(graph: &'a Graph, start: &'a str) -> BTreeSet<&'a str> {
    let (mut found, mut open) = (BTreeSet::new(), vec![start]);
    while let Some(here) = open.pop() {
        for next in graph.get(here).into_iter().flatten() {
            if found.insert(next.as_str()) {
                open.push(next);
            }
        }
    }
    found
}

/// Two folders that depend on each other and are not neighbours.
fn cycle(graph: &Graph, are_neighbours: impl Fn(&str, &str) -> bool) -> Option<[String; 2]> {
    graph.keys().find_map(|one| {
        let others = needs(graph, one);
        let is_in_it = |other: &&&str| needs(graph, other).contains(one.as_str());
        let other = others.iter().filter(|other| !are_neighbours(one, other)).find(is_in_it)?;
        Some([one.clone(), (*other).to_string()])
    })
}

/// Whether a folder is the other one, or in it.
fn is_inside(one: &str, other: &str) -> bool {
    one.strip_prefix(other).is_some_and(|rest| rest.is_empty() || rest.starts_with('/'))
}

#[test]
fn no_folder_needs_itself_by_way_of_another() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    for name in CRATES {
        let source = root.join(name).join("src");
        let is_file = |module: &str| source.join(module).with_extension("rs").exists();
        let graph = graph(&source);
        let found = cycle(&graph, |one, other| one == other || is_file(one) && is_file(other));
        assert_eq!(found, None, "{name}: {graph:#?}");
    }
    for name in COMMANDS {
        let mut graph = graph(&root.join(name).join("src"));
        for (folder, others) in &mut graph {
            others.retain(|other| !is_inside(folder, other));
        }
        let found = cycle(&graph, |one, other| one == other || !one.contains('/') && !other.contains('/'));
        assert_eq!(found, None, "{name}: {graph:#?}");
    }
}

#[test]
fn no_file_of_the_library_needs_itself_by_way_of_another() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/.."));
    for name in LAYERED {
        let graph = graph(&root.join(name).join("src"));
        let found = cycle(&graph, |one, other| is_inside(one, other) || is_inside(other, one));
        assert_eq!(found, None, "{name}: {graph:#?}");
    }
}

#[test]
fn the_graph_agrees_with_the_files() {
    let graph = graph(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/profiles/src")));
    let uses = |folder: &str, other: &str| graph[folder].contains(other);
    assert!(uses("lift", "encoder") && uses("lift/objects", "pressure") && uses("combined", "pair"));
    assert!(uses("pressure/objects", "pressure") && uses("pressure", "board"));
    assert!(!uses("encoder", "lift") && !uses("pressure", "pressure/objects"));
}

#[test]
fn a_cycle_is_found() {
    let graph = |edges: &[(&str, &str)]| {
        let mut graph = Graph::new();
        for (from, to) in edges {
            graph.entry((*from).into()).or_default().insert((*to).into());
        }
        graph
    };
    let same = |one: &str, other: &str| one == other;
    assert_eq!(cycle(&graph(&[("a", "b"), ("b", "c"), ("a", "c")]), same), None);
    let ring = graph(&[("a", "b"), ("b", "c"), ("c", "d"), ("d", "b")]);
    assert_eq!(cycle(&ring, same), Some(["b".to_string(), "c".to_string()]));
    assert_eq!(cycle(&ring, |one, other| "bcd".contains(one) && "bcd".contains(other)), None);
    let mut paths = Vec::new();
    expand("crate::{a::{b, c}, d}", "", &mut paths);
    assert_eq!(paths, ["crate::a::b", "crate::a::c", "crate::d"]);
}
