//! The bootloader as its owner builds it, with one fault in its decision. Here a part of the points, with `--thorough` more; all of
//! them by `cargo xtask fault-injection`.

use std::path::{Path, PathBuf};

use glitch::{Campaign, Extent, Places, Scene, Watcher};

/// $NODE_IMAGES, or where cargo puts them.
fn bootloader() -> Vec<u8> {
    let built = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../target/thumbv7em-none-eabihf/release");
    let path = std::env::var_os("NODE_IMAGES").map_or_else(built, PathBuf::from).join("bootloader-owner");
    std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}; run `cargo xtask test`", path.display()))
}

fn extent() -> Extent {
    if std::env::var("THOROUGH").is_ok_and(|value| value == "1") {
        Extent { every: 10, every_of_conditions: 10, every_of_loops: 200, flips: 4, boards: 2 }
    } else {
        Extent { every: 400, every_of_conditions: 100, every_of_loops: 2000, flips: 1, boards: 1 }
    }
}

/// Every scene by itself: the slowest tests begin first.
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
    assert!(campaign.tried("flags") > 5, "no condition was turned round");
}

#[test]
fn an_application_that_nobody_has_signed_does_not_start() {
    holds("unsigned");
}

#[test]
fn an_application_whose_signature_fits_an_equation_that_is_left_out_does_not_start() {
    holds("neutral");
}

#[test]
fn an_application_whose_release_key_nobody_has_certified_does_not_start() {
    holds("certified");
}

#[test]
fn an_application_without_a_header_does_not_start() {
    holds("bare");
}

#[test]
fn an_application_that_took_the_place_of_a_signed_one_does_not_start() {
    holds("exchanged");
}

#[test]
fn an_older_image_is_not_copied() {
    holds("older");
}

#[test]
fn an_unsigned_image_is_not_started_after_a_copy() {
    holds("waiting");
}

#[test]
fn an_unsigned_image_does_not_come_back_after_a_trial() {
    holds("returning");
}
