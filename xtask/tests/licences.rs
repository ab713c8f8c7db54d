//! Tests that the products under MIT or Apache-2.0 have no dependency under a stricter licence, except those that the
//! README names.

#[path = "../src/metadata.rs"]
mod metadata;

use std::collections::BTreeSet;

use metadata::Metadata;

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
fn the_licences_of_the_products_are_those_of_the_readme() {
    let readme = include_str!("../../README.md");
    let stated = readme.split_once("## Licences").expect("a section about licences").1;
    let mut seen = BTreeSet::new();
    for (root, platform) in SHIPPED {
        let metadata = Metadata::of(platform).unwrap();
        let linked = metadata.linked(root).expect("a package of the workspace");
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
    let metadata = Metadata::of(HOST).unwrap();
    let asks: Vec<_> = metadata
        .linked("sim")
        .expect("a package of the workspace")
        .into_iter()
        .filter(|package| !is_permissive(package.license.as_deref().unwrap_or("none")))
        .map(|package| package.name.as_str())
        .collect();
    assert!(asks.contains(&"unicorn-engine"), "{asks:?}");
}
