//! The trial of a new image, and the return to the previous image.

use crate::bench::{
    Image, assert_starts, certificate, chance, confirm, description, flash_of_words_with, flash_with, holds,
    image_a, image_b, install, is_thorough, key_number, revert, run, stage, start, start_after, target,
    update,
};
use update::key::KeyList;
use update::mock::{MockFlash, Weak};
use update::{
    Clears, Crashes, Decision, Description, Programs, Proof, Reason, Refusal, Reset, Start, Status, Stay,
    Trial, Updater, boot,
};

fn trial(flash: &mut MockFlash) -> Trial {
    Trial::read(flash, &target().layout)
}

fn withdraw(flash: &mut MockFlash) {
    Trial::withdraw(flash, &target().layout).unwrap();
}

/// A node that ran A and now has B on trial.
fn b_on_trial(seed: u64) -> MockFlash {
    let mut flash = flash_with(&image_a(), seed);
    update(&mut flash, &image_b().bytes()).unwrap();
    flash
}

#[test]
fn the_first_image_is_on_no_trial_and_each_one_after_it_is() {
    let mut flash = flash_with(&image_a(), 1);
    assert_eq!(trial(&mut flash), Trial::None, "there is no way back");
    for image in [image_b(), image_a()] {
        update(&mut flash, &image.bytes()).unwrap();
        assert_eq!(trial(&mut flash), Trial::Open);
        assert_starts(&mut flash, &image);
        confirm(&mut flash);
        assert_eq!(trial(&mut flash), Trial::None);
        assert_starts(&mut flash, &image);
    }
}

#[test]
fn three_starts_that_nobody_asked_for_bring_the_image_before_back() {
    for resets in [[Reset::Crash; 3], [Reset::Power; 3], [Reset::Power, Reset::Crash, Reset::Power]] {
        let mut flash = b_on_trial(1);
        let [first, second, third] = resets;
        for reset in [Reset::Asked, first, Reset::Asked, second, Reset::Asked] {
            assert_eq!(start_after(&mut flash, reset), Decision::Start(image_b().header));
        }
        assert_eq!(trial(&mut flash), Trial::Open);
        assert_eq!(start_after(&mut flash, third), Decision::Start(image_a().header));
        assert!(holds(&flash, &image_a()));
        assert_eq!(trial(&mut flash), Trial::Over(Reason::Starts));
    }
}

#[test]
fn a_withdrawn_image_goes_at_the_next_start() {
    let mut flash = b_on_trial(1);
    withdraw(&mut flash);
    assert_eq!(trial(&mut flash), Trial::Lost(Reason::Withdrawn));
    let stay = Start { stay: true, ..Start::default() };
    assert_eq!(boot(&mut flash, &target(), stay), Decision::Revert, "before anything else");
    assert_starts(&mut flash, &image_a());
    assert_eq!(trial(&mut flash), Trial::Over(Reason::Withdrawn));
    update(&mut flash, &image_b().bytes()).unwrap();
    assert_eq!(trial(&mut flash), Trial::Open, "a new image, a new trial");
    assert_starts(&mut flash, &image_b());
}

#[test]
fn nothing_takes_a_confirmed_image_back() {
    let mut flash = b_on_trial(1);
    start_after(&mut flash, Reset::Power);
    confirm(&mut flash);
    for _ in 0..5 {
        assert_eq!(start_after(&mut flash, Reset::Power), Decision::Start(image_b().header));
    }
    withdraw(&mut flash);
    assert_starts(&mut flash, &image_b());
    assert_eq!(revert(&mut flash), Err(Refusal::Unspecified));
}

#[test]
fn a_restart_that_another_start_decides_is_no_start() {
    let mut flash = b_on_trial(1);
    let start = Start { reset: Reset::Crash, proof: Proof::Waived, ..Start::default() };
    for _ in 0..5 {
        assert_eq!(boot(&mut flash, &target(), start), Decision::Start(image_b().header));
    }
    assert_eq!(trial(&mut flash), Trial::Open);
}

#[test]
fn the_next_update_is_refused_until_the_trial_is_decided() {
    let image_c = Image::new(description(3, 5), 804);
    let mut flash = b_on_trial(1);
    let before = flash.bytes();
    assert_eq!(update(&mut flash, &image_c.bytes()), Err(Refusal::OnTrial));
    assert!(flash.bytes() == before, "nothing is changed");
    let mut confirmed = flash.clone();
    confirm(&mut confirmed);
    update(&mut confirmed, &image_c.bytes()).unwrap();
    assert_starts(&mut confirmed, &image_c);
    withdraw(&mut confirmed);
    assert_starts(&mut confirmed, &image_b());
    withdraw(&mut flash);
    assert_eq!(update(&mut flash, &image_c.bytes()), Err(Refusal::OnTrial), "the return is not complete");
    assert_starts(&mut flash, &image_a());
    update(&mut flash, &image_c.bytes()).unwrap();
    withdraw(&mut flash);
    assert_starts(&mut flash, &image_a());
}

/// The application area cannot be programmed: the node has a program again after the next start.
#[test]
fn a_copy_that_fails_brings_the_kept_image_back() {
    let mut flash = flash_with(&image_a(), 1);
    stage(&mut flash, &image_b().bytes()).unwrap();
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.install().unwrap();
    let application = target().layout.application().start() as usize;
    while updater.flash().bytes()[application..application + 1024].iter().any(|byte| *byte != 0xFF) {
        updater.poll();
    }
    // A cell that does not erase.
    updater.flash().disturb(application + 600, |_| 0);
    assert_eq!(run(&mut updater), Err(Refusal::Unspecified));
    assert_eq!(updater.status().code, Refusal::NotCleared.code());
    assert_starts(&mut flash, &image_a());
    assert_eq!(trial(&mut flash), Trial::Over(Reason::Withdrawn));
}

/// The counter of an image applies from its confirmation on; otherwise a failed trial could not return to the previous
/// image.
#[test]
fn the_counter_and_the_keys_of_an_image_on_trial_are_not_kept_yet() {
    let mut flash = flash_with(&image_a(), 1);
    let keys = KeyList { release: Some(certificate(1, 0, 3, 1)), root: None };
    let newer = Image::new(update::Description { keys, ..description(2, 9) }, 404).signed_by(&key_number(3));
    update(&mut flash, &newer.bytes()).unwrap();
    assert_starts(&mut flash, &newer);
    withdraw(&mut flash);
    assert_starts(&mut flash, &image_a());
    update(&mut flash, &newer.bytes()).unwrap();
    assert_starts(&mut flash, &newer);
    confirm(&mut flash);
    assert_starts(&mut flash, &newer);
    assert_eq!(stage(&mut flash, &image_a().bytes()), Err(Refusal::Counter { least: 9 }));
}

#[test]
fn a_way_back_that_is_damaged_leaves_the_image_in_place() {
    let mut flash = b_on_trial(1);
    let kept = target().layout.kept().start() as usize;
    flash.disturb(kept + 600, |byte| byte ^ 1);
    withdraw(&mut flash);
    assert_starts(&mut flash, &image_b());
    assert_eq!(trial(&mut flash), Trial::None, "there is no way back any more");
    let crashes = (0..3).fold(Crashes::default(), |crashes, _| crashes.after(Reset::Crash));
    let start = Start { reset: Reset::Crash, crashes, ..Start::default() };
    assert_eq!(boot(&mut flash, &target(), start), Decision::Stay(Stay::Crashes(3)));
}

#[test]
fn a_kept_image_that_nobody_has_signed_does_not_come_back() {
    let mut flash = flash_with(&image_a(), 1);
    let forged = Image { header: image_a().header, code: image_b().code };
    let header = update::Header::describe(description(1, 5), &forged.code).unwrap();
    let forged = Image { header: header.with_signature([1; 64]), ..forged };
    let at = target().layout.application().start() as usize;
    for (place, byte) in (at..).zip(forged.bytes()) {
        flash.disturb(place, |_| byte);
    }
    update(&mut flash, &image_b().bytes()).unwrap();
    withdraw(&mut flash);
    assert_starts(&mut flash, &image_b());
}

/// A debugger has written another program: the trial does not concern that program.
#[test]
fn a_program_that_a_debugger_puts_there_is_on_no_trial() {
    for is_over in [false, true] {
        let mut flash = b_on_trial(1);
        if is_over {
            withdraw(&mut flash);
            assert_starts(&mut flash, &image_a());
        }
        let image_c = Image::new(description(3, 5), 404);
        let at = target().layout.application().start() as usize;
        for (place, byte) in (at..).zip(image_c.bytes()) {
            flash.disturb(place, |_| byte);
        }
        assert_eq!(trial(&mut flash), Trial::None);
        for _ in 0..4 {
            assert_eq!(start_after(&mut flash, Reset::Power), Decision::Start(image_c.header));
        }
    }
}

#[test]
fn a_damaged_application_is_not_kept_and_the_new_one_is_on_no_trial() {
    let mut flash = flash_with(&image_a(), 1);
    let at = target().layout.application().start() as usize;
    flash.disturb(at + 600, |byte| byte ^ 1);
    update(&mut flash, &image_b().bytes()).unwrap();
    assert_starts(&mut flash, &image_b());
    assert_eq!(trial(&mut flash), Trial::None);
}

/// Power cuts in each operation from the commit to the end of the swap, in each way, and in some operation of the
/// recovery: the image that starts is complete, and if B is in place A can come back.
#[test]
fn after_a_cut_anywhere_in_the_swap_there_is_a_way_back() {
    for word in [4, 8] {
        let mut committed = flash_of_words_with(&image_a(), word, 1);
        stage(&mut committed, &image_b().bytes()).unwrap();
        cut_everywhere(
            &committed,
            |flash| install(flash).is_ok(),
            |flash| {
                assert_starts(flash, &image_b());
                assert_eq!(trial(flash), Trial::Open);
                withdraw(flash);
                assert_starts(flash, &image_a());
            },
        );
    }
}

/// Power cuts in each operation of the return, in each way, and in some operation of the recovery: A starts, and B does
/// not come back.
#[test]
fn after_a_cut_anywhere_on_the_way_back_the_image_before_starts() {
    for word in [4, 8] {
        let mut lost = flash_of_words_with(&image_a(), word, 1);
        update(&mut lost, &image_b().bytes()).unwrap();
        withdraw(&mut lost);
        cut_everywhere(
            &lost,
            |flash| revert(flash).is_ok(),
            |flash| {
                assert_starts(flash, &image_a());
                assert!(matches!(trial(flash), Trial::Over(Reason::Withdrawn)));
            },
        );
    }
}

/// A mark of the trial was cut: B or A starts, and the one that starts is complete. Once A has come back it stays.
#[test]
fn a_cut_in_a_mark_decides_for_one_of_the_two() {
    let acts: [fn(&mut MockFlash) -> bool; 3] = [
        |flash| Trial::withdraw(flash, &target().layout).is_ok(),
        |flash| Trial::confirm(flash, &target().layout).is_ok(),
        |flash| boot(flash, &target(), Start { reset: Reset::Power, ..Start::default() }) == Decision::Revert,
    ];
    let mut seen = [0; 2];
    for (act, seed) in acts.iter().flat_map(|act| (0..24).map(move |seed| (act, seed))) {
        let mut flash = b_on_trial(seed);
        start_after(&mut flash, Reset::Power);
        start_after(&mut flash, Reset::Power);
        flash.cut_after(0, Weak::ALL[seed as usize % 4]);
        assert!(!act(&mut flash) && flash.is_down());
        let mut is_back = false;
        for _ in 0..6 {
            flash.power_up();
            let decision = start(&mut flash);
            let is_a = decision == Decision::Start(image_a().header) && holds(&flash, &image_a());
            assert!(is_a || decision == Decision::Start(image_b().header) && holds(&flash, &image_b()));
            assert!(is_a || !is_back, "decided once");
            is_back = is_a;
        }
        seen[usize::from(is_back)] += 1;
    }
    assert!(seen.iter().all(|count| *count > 5), "{seen:?}");
}

/// Cuts `act` in each operation, or in every third; then the recovery in a random operation.
fn cut_everywhere(flash: &MockFlash, act: impl Fn(&mut MockFlash) -> bool, check: impl Fn(&mut MockFlash)) {
    let mut whole = flash.clone();
    assert!(act(&mut whole));
    let operations = whole.operations() - flash.operations();
    let mut cuts = 0;
    let step = if is_thorough() { 1 } else { 3 };
    let near_an_end = |at: u32| at < 6 || operations - at < 6;
    for at in (0..operations).filter(|at| at % step == 0 || near_an_end(*at)) {
        for (number, weak) in (0..).zip(Weak::ALL) {
            let mut cut = flash.clone();
            cut.cut_after(at, weak);
            assert!(!act(&mut cut) && cut.is_down());
            cut.power_up();
            let mut again = cut.clone();
            check(&mut cut);
            again.cut_after(chance(at * 4 + number) % operations, weak);
            start(&mut again);
            again.power_up();
            check(&mut again);
            cuts += 2;
        }
    }
    println!("{cuts} cuts in {operations} operations");
}

/// What a master reads of the programs of a node, through an update that comes back and one that is confirmed.
#[test]
fn the_programs_in_the_flash_are_known_through_return_and_confirmation() {
    let mut flash = flash_with(&image_a(), 1);
    let known = |flash: &mut MockFlash| Programs::read(flash, &target().layout, Clears::default());
    let [a, b] = [image_a(), image_b()].map(|image| image.header.code_crc());
    assert_eq!(
        known(&mut flash),
        Programs { staged: a, erases: 2, clears_allowed: 50, ..Programs::default() }
    );
    update(&mut flash, &image_b().bytes()).unwrap();
    assert_eq!((known(&mut flash).staged, known(&mut flash).kept), (b, a));
    withdraw(&mut flash);
    revert(&mut flash).unwrap();
    assert_eq!((known(&mut flash).staged, known(&mut flash).kept), (b, a), "who was tried");

    let keys = KeyList { release: Some(certificate(3, 0, 3, 1)), root: None };
    let next = Image::new(Description { keys, ..description(9, 7) }, 900).signed_by(&key_number(3));
    update(&mut flash, &next.bytes()).unwrap();
    assert_eq!((known(&mut flash).counter, known(&mut flash).generation), (0, 0), "on trial");
    confirm(&mut flash);
    start(&mut flash);
    let staged = next.header.code_crc();
    let expected =
        Programs { counter: 7, generation: 3, staged, kept: a, erases: 2 + 3 + 1 + 3, clears_allowed: 50 };
    assert_eq!(known(&mut flash), expected);
}

#[test]
fn a_flash_that_cannot_keep_the_application_refuses_the_update_and_the_application_stays() {
    let mut flash = flash_with(&image_a(), 1);
    stage(&mut flash, &image_b().bytes()).unwrap();
    let kept = target().layout.kept().start() as usize;
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.install().unwrap();
    while updater.phase() != update::Phase::Copying {
        updater.poll();
    }
    // A cell that does not erase: it is set to 0 again before it is checked.
    for _ in 0..5 {
        updater.poll();
    }
    updater.flash().disturb(kept + 8, |_| 0);
    assert_eq!(run(&mut updater), Err(Refusal::Unspecified));
    assert_eq!(updater.status().code, Refusal::NotCleared.code());
    assert_starts(&mut flash, &image_a());
}
