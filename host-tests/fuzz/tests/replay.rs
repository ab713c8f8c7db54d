//! Every input of the corpus, and some random inputs: the same at every run.

use std::fs;
use std::path::Path;

use fuzz::TARGETS;

/// Random inputs for each target.
const RANDOM: u64 = 200;
/// Longest random input in bytes.
const LONGEST: usize = 600;

#[test]
fn the_corpus_breaks_no_rule() {
    for target in TARGETS {
        let file =
            Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(target.name).with_extension("hex");
        let corpus = fs::read_to_string(&file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        assert!(!corpus.is_empty(), "{}", file.display());
        for line in corpus.lines() {
            let input = hex::decode(line).expect("two digits a byte");
            let outcome = std::panic::catch_unwind(|| (target.run)(&input));
            assert!(outcome.is_ok(), "{}: {line}", target.name);
        }
        println!("{}: {} inputs of the corpus", target.name, corpus.lines().count());
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
