//! Cuts in the words that decide, each followed by cuts in the recovery: a word that reads well once may not do so
//! again.

use crate::bench::{Image, description, flash_of_words_with, holds, install, stage, start};
use update::Decision;
use update::mock::{MockFlash, Weak};

/// Images of one word of code, with few operations and so with few pairs of cuts to try.
fn image(version: u16) -> Image {
    Image::new(description(version, 5), 4)
}

fn operations(flash: &MockFlash, act: impl FnOnce(&mut MockFlash) -> bool) -> u32 {
    let mut after = flash.clone();
    assert!(act(&mut after));
    after.operations() - flash.operations()
}

/// Asserts that one of the images starts, and that it is complete.
fn assert_whole(flash: &mut MockFlash, images: &[Image]) {
    let decision = start(flash);
    let whole = images.iter().any(|image| decision == Decision::Start(image.header) && holds(flash, image));
    assert!(whole, "{decision:?}");
}

/// Cuts `act` in `operation`, in every way, then cuts the recovery at its start, at its end and in between, in every
/// way. The image that starts is one of `images`, and the same at each later start. Returns the number of pairs.
fn cut_twice(
    flash: &MockFlash,
    act: impl Fn(&mut MockFlash) -> bool,
    operation: u32,
    images: &[Image],
) -> u32 {
    let mut pairs = 0;
    for weak in Weak::ALL {
        let mut first = flash.clone();
        first.cut_after(operation, weak);
        assert!(!act(&mut first) && first.is_down());
        first.power_up();
        let recovery = operations(&first, |flash| matches!(start(flash), Decision::Start(_)));
        let near_an_end = |at: u32| at < 5 || recovery - at < 5;
        for at in (0..recovery).filter(|at| near_an_end(*at) || at % 9 == 0) {
            let mut flash = first.clone();
            flash.cut_after(at, Weak::ALL[pairs as usize % 4]);
            start(&mut flash);
            for _ in 0..2 {
                flash.power_up();
                assert_whole(&mut flash, images);
            }
            pairs += 1;
        }
    }
    pairs
}

#[test]
fn cuts_in_the_commit() {
    cuts_in_the_commit_of(4, 300);
}

#[test]
fn cuts_in_the_commit_in_words_of_eight_bytes() {
    cuts_in_the_commit_of(8, 300 / 2);
}

fn cuts_in_the_commit_of(word: usize, at_least: u32) {
    let act = |flash: &mut MockFlash| stage(flash, &image(2).bytes()).is_ok();
    let mut pairs = 0;
    for seed in 0..4 {
        let flash = flash_of_words_with(&image(1), word, seed);
        let end = operations(&flash, act);
        pairs += (end - 4..end).map(|at| cut_twice(&flash, act, at, &[image(1), image(2)])).sum::<u32>();
    }
    println!("{pairs} pairs of cuts in and after the commit");
    assert!(pairs > at_least);
}

#[test]
fn a_commit_that_was_cut_is_decided_once() {
    let mut decisions = Vec::new();
    for seed in 0..24 {
        let mut flash = flash_of_words_with(&image(1), 4, seed);
        let commit = operations(&flash, |flash| stage(flash, &image(2).bytes()).is_ok());
        flash.cut_after(commit - 1, Weak::Either);
        assert!(stage(&mut flash, &image(2).bytes()).is_err());
        let mut starts = (0..4).map(|_| {
            flash.power_up();
            start(&mut flash)
        });
        let first = starts.next().unwrap();
        assert!(starts.all(|again| again == first));
        decisions.push(first);
    }
    assert!([1, 2].map(image).iter().all(|image| decisions.contains(&Decision::Start(image.header))));
}

#[test]
fn cuts_around_the_mark_that_the_copy_is_done() {
    cuts_around_the_mark_that_the_copy_is_done_of(4, 500);
}

#[test]
fn cuts_around_the_mark_that_the_copy_is_done_in_words_of_eight_bytes() {
    cuts_around_the_mark_that_the_copy_is_done_of(8, 500 / 2);
}

fn cuts_around_the_mark_that_the_copy_is_done_of(word: usize, at_least: u32) {
    let mut flash = flash_of_words_with(&image(1), word, 1);
    stage(&mut flash, &image(2).bytes()).unwrap();
    let act = |flash: &mut MockFlash| install(flash).is_ok();
    let end = operations(&flash, act);
    let cuts = (0..4).chain(end - 4..end);
    let pairs = cuts.map(|at| cut_twice(&flash, act, at, &[image(1), image(2)])).sum::<u32>();
    println!("{pairs} pairs of cuts at the begin and the end of the copy");
    assert!(pairs > at_least);
}

/// An image that was committed but not copied is cleared for the next one.
#[test]
fn cuts_in_the_clear_of_a_committed_image() {
    cuts_in_the_clear_of_a_committed_image_of(4, 300);
}

#[test]
fn cuts_in_the_clear_of_a_committed_image_in_words_of_eight_bytes() {
    cuts_in_the_clear_of_a_committed_image_of(8, 300 / 2);
}

fn cuts_in_the_clear_of_a_committed_image_of(word: usize, at_least: u32) {
    let act = |flash: &mut MockFlash| stage(flash, &image(3).bytes()).is_ok();
    let mut pairs = 0;
    for seed in 0..4 {
        let mut flash = flash_of_words_with(&image(1), word, seed);
        stage(&mut flash, &image(2).bytes()).unwrap();
        pairs += (0..8).map(|at| cut_twice(&flash, act, at, &[image(1), image(2)])).sum::<u32>();
    }
    println!("{pairs} pairs of cuts in and after the clear");
    assert!(pairs > at_least);
}
