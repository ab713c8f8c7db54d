//! A reference model of the shaft judges every position: a position that is wrong must say so, and one that says so
//! must be believed again as soon as it can be.
//!
//! Each case is a sensor type with a range, a personality, and two positions, on one sensor or on two unequal ones. A cycle moves the shaft at
//! random, disturbs the readings, writes presets and settings, and ends with a reset. `THOROUGH=1` runs 10,000 cycles
//! and prints the table of docs/evidence.md.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss)]

mod devices;
mod shaft;
mod tally;

use devices::{Combined, Device, EncoderDevice, LiftDevice};
use profiles::encoder::{Encoder, SensorType};
use shaft::{Case, World};
use tally::Tally;

/// Cycles for each case.
fn cycles() -> u32 {
    if std::env::var("THOROUGH").is_ok_and(|value| value == "1") { 400 } else { 12 }
}

const KINDS: [SensorType; 9] = [
    SensorType::SingleTurn,
    SensorType::MultiTurn,
    SensorType::SingleTurnCounted,
    SensorType::Incremental,
    SensorType::IncrementalCounted,
    SensorType::LinearIncremental,
    SensorType::LinearIncrementalCounted,
    SensorType::LinearAbsolute,
    SensorType::LinearCyclic,
];

/// Every sensor type, with the range of its code, with another one and behind a gear, with and without an index.
fn cases() -> impl Iterator<Item = Case> {
    KINDS.into_iter().flat_map(|kind| {
        let indexes: &[bool] = if kind.is_absolute() { &[false] } else { &[false, true] };
        let case =
            move |(index, is_scaled, is_geared)| Case { kind, second: kind, index, is_scaled, is_geared };
        let scales = [(false, false), (true, false), (true, true)];
        let scaled =
            move |index: &bool| scales.map(|(is_scaled, is_geared)| case((*index, is_scaled, is_geared)));
        indexes.iter().flat_map(scaled)
    })
}

/// Each sensor type beside one of the other kind: one is counted, the other one read over SSI.
fn unequal_cases() -> impl Iterator<Item = Case> {
    let others =
        |kind: SensorType| KINDS.into_iter().filter(move |other| other.is_absolute() != kind.is_absolute());
    let pairs = KINDS.into_iter().flat_map(move |kind| others(kind).map(move |second| (kind, second)));
    pairs.zip(0..).map(|((kind, second), number)| {
        let (index, is_scaled) = (number % 2 == 0, number % 3 == 0);
        Case { kind, second, index, is_scaled, is_geared: false }
    })
}

fn judge<D: Device>(seed: u64, cases: impl Iterator<Item = Case>, new: impl Fn(&Case) -> D) -> Tally {
    let mut all = Tally::default();
    for (number, case) in (0..).zip(cases) {
        let mut world = World::new(case, new(&case), seed + number);
        (0..cycles()).for_each(|_| world.cycle());
        all.add(world.tally);
    }
    all.print();
    all
}

#[test]
fn an_encoder_never_shows_a_wrong_position_as_right() {
    judge(1, cases(), EncoderDevice::<Encoder>::new).assert_good();
}

#[test]
fn the_encoder_of_a_combined_device_never_shows_a_wrong_position_as_right() {
    judge(2000, cases(), EncoderDevice::<Combined>::new).assert_good();
}

#[test]
fn position_units_of_a_lift_never_show_a_wrong_position_as_right() {
    judge(1000, cases().filter(|case| !case.is_geared), LiftDevice::new).assert_good();
}

#[test]
fn two_channels_on_unequal_sensors_never_show_a_wrong_position_as_right() {
    judge(3000, unequal_cases(), EncoderDevice::<Encoder>::new).assert_good();
}

#[test]
fn units_of_a_lift_on_unequal_sensors_never_show_a_wrong_position_as_right() {
    judge(4000, unequal_cases(), LiftDevice::new).assert_good();
}
