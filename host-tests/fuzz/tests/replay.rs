//! Every input of the corpus, and some by chance: the same at every run.

use std::fs;
use std::path::Path;

use fuzz::TARGETS;

/// Inputs by chance for each target.
const RANDOM: u64 = 2000;
/// Longest of them.
const LONGEST: usize = 600;

#[test]
fn the_corpus_breaks_no_rule() {
    for target in TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name);
        let mut files: Vec<_> = fs::read_dir(&folder)
            .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
            .map(|entry| entry.expect("a file").path())
            .collect();
        files.sort();
        assert!(!files.is_empty(), "{} is empty", folder.display());
        for file in &files {
            let input = fs::read(file).expect("an input");
            let outcome = std::panic::catch_unwind(|| (target.run)(&input));
            assert!(outcome.is_ok(), "{}", file.display());
        }
        println!("{}: {} inputs of the corpus", target.name, files.len());
    }
}

#[test]
fn inputs_by_chance_break_no_rule() {
    for target in TARGETS {
        for seed in 0..RANDOM {
            let mut rng = fastrand::Rng::with_seed(seed);
            let len = rng.usize(..LONGEST);
            let input: Vec<u8> = std::iter::repeat_with(|| rng.u8(..)).take(len).collect();
            let outcome = std::panic::catch_unwind(|| (target.run)(&input));
            assert!(outcome.is_ok(), "{}: seed {seed}", target.name);
        }
    }
}
