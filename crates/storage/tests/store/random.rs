//! Random histories of a device, compared with the model; proptest shrinks failures. The seed is fixed.

use crate::model::{Changes, EMPTY, Step, noise, recover, run};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use storage::mock::{MockFlash, Weak};
use storage::{GroupNumber, Pages};

const fn pages(word: usize) -> Pages {
    Pages::new(512, 512).with_words(word as u32)
}

/// The steps of a device until the power cut, the operation of the cut, and how weak bits read afterwards.
type Life = (Vec<Step>, u32, Weak);

fn changes() -> impl Strategy<Value = Changes> {
    let group = prop::sample::select(GroupNumber::ALL.to_vec());
    let value = prop::option::weighted(0.8, (any::<u16>(), 0_usize..120));
    let value = value.prop_map(|value| value.map(|(version, len)| (version, noise(len as u64, len))));
    vec((group, value), 1..4)
}

fn step() -> impl Strategy<Value = Step> {
    prop_oneof![4 => changes().prop_map(Step::Save), 1 => Just(Step::Restart), 1 => Just(Step::MakeRoom)]
}

fn life() -> impl Strategy<Value = Life> {
    let weak = prop::sample::select(vec![Weak::Before, Weak::After, Weak::Random]);
    (vec(step(), 1..12), 0_u32..400, weak)
}

fn random_lives_agree_with_the_model<const WORD: usize>() {
    let config = Config { cases: 600, failure_persistence: None, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let lives = (any::<u64>(), vec(life(), 1..6));
    let outcome = TestRunner::new_with_rng(config, rng).run(&lives, |(seed, lives)| {
        let mut flash = MockFlash::<512, WORD>::new(2048, seed);
        let mut model = EMPTY;
        for (steps, operations, weak) in lives {
            flash.cut_after(operations, weak);
            let allowed = run(&mut flash, pages(WORD), &steps, model);
            model = recover(&mut flash, pages(WORD), &allowed);
        }
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{error}"));
}

#[test]
fn random_lives_agree_with_the_model_on_words_of_four_bytes() {
    random_lives_agree_with_the_model::<4>();
}

#[test]
fn random_lives_agree_with_the_model_on_words_of_eight_bytes() {
    random_lives_agree_with_the_model::<8>();
}
