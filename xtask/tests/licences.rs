//! Tests that the products under MIT or Apache-2.0 have no dependency under a stricter licence, except those that the
//! README names.

use std::collections::{BTreeSet, HashMap};
use std::process::Command;

use serde::Deserialize;

const CORTEX_M4: &str = "thumbv7em-none-eabihf";
const HOST: &str = env!("XTASK_HOST");
/// Each product and the machine that it runs on.
const SHIPPED: [(&str, &str); 5] = [
    ("firmware", CORTEX_M4),
    ("bootloader", CORTEX_M4),
    ("canopen-device", CORTEX_M4),
    ("canopen-device", HOST),
    ("nodectl", HOST),
];
/// Licences that demand their text to be included, but no source code.
const PERMISSIVE: [&str; 13] = [
    "0BSD",
    "Apache-2.0",
    "BSD-2-Clause",
    "BSD-3-Clause",
    "BSL-1.0",
    "CC0-1.0",
    "ISC",
    "MIT",
    "Unicode-3.0",
    "Unicode-DFS-2016",
    "Unlicense",
    "WTFPL",
    "Zlib",
];

#[derive(Deserialize)]
struct Metadata {
    packages: Vec<Package>,
    resolve: Resolve,
}

#[derive(Deserialize)]
struct Package {
    id: String,
    name: String,
    license: Option<String>,
}

#[derive(Deserialize)]
struct Resolve {
    nodes: Vec<Node>,
}

#[derive(Deserialize)]
struct Node {
    id: String,
    deps: Vec<Dependency>,
}

#[derive(Deserialize)]
struct Dependency {
    pkg: String,
    dep_kinds: Vec<Kind>,
}

#[derive(Deserialize)]
struct Kind {
    /// `None` for a dependency that is linked, else `build` or `dev`.
    kind: Option<String>,
}

impl Metadata {
    fn of(platform: &str) -> Metadata {
        let arguments = ["metadata", "--format-version", "1", "--locked", "--filter-platform", platform];
        let output = Command::new(env!("CARGO")).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap()
    }

    /// The packages that are linked into a package of the workspace, including that package.
    fn linked(&self, root: &str) -> Vec<&Package> {
        let packages: HashMap<&str, &Package> =
            self.packages.iter().map(|own| (own.id.as_str(), own)).collect();
        let nodes: HashMap<&str, &Node> =
            self.resolve.nodes.iter().map(|node| (node.id.as_str(), node)).collect();
        let first =
            self.packages.iter().find(|package| package.name == root).expect("a package of the workspace");
        let (mut found, mut left) = (BTreeSet::from([first.id.as_str()]), vec![first.id.as_str()]);
        while let Some(id) = left.pop() {
            let is_linked =
                |dependency: &&Dependency| dependency.dep_kinds.iter().any(|kind| kind.kind.is_none());
            for dependency in nodes[id].deps.iter().filter(is_linked) {
                if found.insert(&dependency.pkg) {
                    left.push(&dependency.pkg);
                }
            }
        }
        found.into_iter().map(|id| packages[id]).collect()
    }
}

/// Whether an SPDX expression allows the choice of a permissive licence. A slash is an old form of OR.
fn is_permissive(expression: &str) -> bool {
    let spaced = expression.replace('/', " OR ").replace('(', " ( ").replace(')', " ) ");
    let mut words = spaced.split_whitespace().peekable();
    let allowed = any(&mut words);
    assert_eq!(words.next(), None, "{expression}");
    allowed
}

type Words<'a> = std::iter::Peekable<std::str::SplitWhitespace<'a>>;

fn any(words: &mut Words<'_>) -> bool {
    let mut allowed = all(words);
    while words.next_if_eq(&"OR").is_some() {
        allowed |= all(words);
    }
    allowed
}

fn all(words: &mut Words<'_>) -> bool {
    let mut allowed = one(words);
    while words.next_if_eq(&"AND").is_some() {
        allowed &= one(words);
    }
    allowed
}

fn one(words: &mut Words<'_>) -> bool {
    let word = words.next().expect("a licence");
    if word == "(" {
        let allowed = any(words);
        assert_eq!(words.next(), Some(")"));
        return allowed;
    }
    // An exception only adds permissions to the licence.
    if words.next_if_eq(&"WITH").is_some() {
        words.next();
    }
    PERMISSIVE.contains(&word)
}

#[test]
fn an_expression_is_permissive_when_one_of_its_choices_is() {
    for good in ["MIT", "MIT/Apache-2.0", "(MIT OR Apache-2.0) AND Unicode-3.0", "MIT OR GPL-3.0-only"] {
        assert!(is_permissive(good), "{good}");
    }
    assert!(is_permissive("Apache-2.0 WITH LLVM-exception OR MPL-2.0"));
    for bad in
        ["GPL-2.0-only", "MPL-2.0", "MIT AND MPL-2.0", "(MIT OR GPL-2.0) AND LGPL-3.0-only", "unheard of"]
    {
        let parsed = std::panic::catch_unwind(|| is_permissive(bad));
        assert!(!parsed.unwrap_or(false), "{bad}");
    }
}

#[test]
fn what_is_shipped_asks_for_no_more_than_the_readme_says() {
    let readme = include_str!("../../README.md");
    let stated = readme.split_once("## Licences").expect("a section about licences").1;
    let mut seen = BTreeSet::new();
    for (root, platform) in SHIPPED {
        let metadata = Metadata::of(platform);
        let linked = metadata.linked(root);
        assert!(!linked.is_empty());
        for package in linked {
            let licence = package.license.as_deref().unwrap_or("none");
            if !is_permissive(licence) {
                let says = format!("`{root}` links `{}` ({licence})", package.name);
                assert!(stated.contains(&says), "the README does not say: {says}");
                seen.insert(says);
            }
        }
    }
    let number = stated.matches(" links `").count();
    assert_eq!(number, seen.len(), "the README says more than is so: {seen:?}");
}

#[test]
fn the_emulator_would_be_found_out() {
    let metadata = Metadata::of(HOST);
    let asks: Vec<_> = metadata
        .linked("sim")
        .into_iter()
        .filter(|package| !is_permissive(package.license.as_deref().unwrap_or("none")))
        .map(|package| package.name.as_str())
        .collect();
    assert!(asks.contains(&"unicorn-engine"), "{asks:?}");
}
