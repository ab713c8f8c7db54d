//! The bootloader of an owner with one fault in its decision. These tests sample the points, with `--thorough` more of them;
//! `cargo xtask fault-injection` covers all.

use std::path::{Path, PathBuf};

use glitch::{Campaign, Extent, Places, Scene, Watcher};

/// The image in $NODE_IMAGES, or in the target directory of cargo.
fn bootloader() -> Vec<u8> {
    let built = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/thumbv7em-none-eabihf/release");
    let path = std::env::var_os("NODE_IMAGES").map_or_else(built, PathBuf::from).join("bootloader-owner");
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}; run `cargo xtask test`", path.display()))
}

fn extent() -> Extent {
    if std::env::var("THOROUGH").is_ok_and(|value| value == "1") {
        Extent { every: 10, every_of_conditions: 10, every_of_loops: 200, flips: 4, pairs: None, boards: 2 }
    } else {
        Extent {
            every: 400,
            every_of_conditions: 100,
            every_of_loops: 2000,
            flips: 1,
            pairs: None,
            boards: 1,
        }
    }
}

/// One test for each scene, so that they run in parallel.
fn holds(name: &str) {
    let bootloader = bootloader();
    let scene = Scene::all().unwrap().into_iter().find(|scene| scene.name == name).unwrap();
    let watcher = Watcher { takes: &|_| true, broken: &|_| () };
    let campaign = Campaign::run(&bootloader, &scene, extent(), &watcher).unwrap();
    println!("{name}: {} faults at {} points: {:?}", campaign.faults(), campaign.points, campaign.outcomes);
    let places = Places::of(&bootloader).unwrap();
    let broken = campaign
        .violations
        .iter()
        .map(|violation| (violation.fault, violation.point.visit, places.name(violation.fault.address())));
    assert_eq!(broken.collect::<Vec<_>>(), [], "{}", scene.what);
    assert!(campaign.faults() > 5);
    assert!(campaign.tried("flags") > 5, "no flag was inverted");
}

#[test]
fn an_unsigned_application_is_not_started() {
    holds("unsigned");
}

#[test]
fn a_signature_of_the_neutral_point_is_not_accepted() {
    holds("neutral");
}

#[test]
fn an_application_with_an_uncertified_release_key_is_not_started() {
    holds("certified");
}

#[test]
fn an_application_without_a_header_is_not_started() {
    holds("bare");
}

#[test]
fn an_application_that_was_exchanged_before_a_reset_is_not_started() {
    holds("exchanged");
}

#[test]
fn an_older_staged_image_is_not_started() {
    holds("older");
}

#[test]
fn an_unsigned_staged_image_is_not_started() {
    holds("waiting");
}

#[test]
fn an_unsigned_kept_image_is_not_restored_after_a_failed_trial() {
    holds("returning");
}
