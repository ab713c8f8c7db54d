//! A small lift on one bus. Two nodes in personality lift are the car position unit and the load measuring unit with a
//! panel. Call controller, drive, doors, light barriers and a display are virtual devices of the host. All of them run
//! the same CANopen device, with dictionaries from the same catalogue. With feature `board` there is a second lift,
//! with emulated boards that run the firmware as its nodes.

#[cfg(feature = "board")]
mod boards;
mod car;
mod controller;
mod device;
mod installer;
mod log;
mod node;
mod small_lift;
#[cfg(feature = "board")]
#[path = "../board/support.rs"]
#[allow(dead_code)] // The tests of single boards use the other functions.
mod support;
mod table;
mod world;

use canopen::Frame;
use canopen::pdo::{Address, Mpdo};
use canopen::sdo::Multiplexer;
use host_tests::network::from_bus;
use profiles::encoder::UNDERFLOW;
use profiles::lift::catalogue::by_cob_id;
use profiles::lift::load::{FULL_LOAD, HALF_LOAD, OVERLOAD, ZERO_LOAD};

use controller::{FAST, LANDINGS, call};
use installer::Site;
use log::every_frame_is_known;
use small_lift::SmallLift;
use table::{CONTROLLER, LOAD, POSITION};

#[test]
fn a_small_lift() {
    let mut lift = SmallLift::new();
    lift.describe_position_unit();
    lift.run(5);
    lift.preset();
    lift.describe_load_and_panel();
    lift.save();
    lift.run(5);
    assert_eq!(lift.read(POSITION, 0x1000, 0), 0x0600_01A1, "a car position unit");
    assert_eq!(lift.read(LOAD, 0x1000, 0), 0x0000_01A1, "load measuring unit, input and output panel unit");
    assert_eq!(lift.read(POSITION, 0x6383, 1), u64::from(LANDINGS[0]), "the preset outlives the reset");

    lift.nmt(1, 0);
    lift.run(300);
    assert_eq!((lift.last(0x188, 0), lift.last(0x188, 1)), (ZERO_LOAD.into(), 0));
    assert!(lift.doors_are(car::WIDTH) && !lift.is_lit());

    too_many_people(&mut lift);
    a_person_in_the_door(&mut lift);
    up_and_down(&mut lift);

    every_frame_is_known(&lift.log);
    every_position_is_that_of_the_car(&lift);
    the_display_shows_the_values_of_its_lift(&mut lift);
    the_lamp_can_be_lit_by_a_multiplexed_pdo(&mut lift);
    assert_eq!(lift.network.traffic().errors, 0);
}

/// With 700 kg in the car it does not leave, although it is called.
fn too_many_people(lift: &mut SmallLift) {
    lift.load(700.0);
    let signals = u64::from(HALF_LOAD | FULL_LOAD | OVERLOAD);
    assert_eq!((lift.last(0x188, 0), lift.last(0x188, 1)), (signals, 700));
    lift.press_button();
    assert!(lift.is_lit(), "the call is taken");
    lift.run(1000);
    assert!(lift.doors_are(car::WIDTH));
    assert_eq!(lift.position(), u64::from(LANDINGS[0]));
}

/// A person leaves the car slowly: the doors open again.
fn a_person_in_the_door(lift: &mut SmallLift) {
    lift.load(640.0);
    assert_eq!(lift.last(0x188, 0) & u64::from(OVERLOAD), 0);
    lift.run_until(500, |lift| !lift.doors_are(car::WIDTH));
    lift.world.borrow_mut().is_blocked[1] = true;
    lift.run_until(700, |lift| lift.doors_are(car::WIDTH));
    assert_eq!(lift.position(), u64::from(LANDINGS[0]));
    lift.world.borrow_mut().is_blocked[1] = false;
    lift.run_until(1000, |lift| lift.doors_are(0.0));
}

/// Drives four floors up at full speed, and three down.
fn up_and_down(lift: &mut SmallLift) {
    for (landing, position) in [(4, LANDINGS[4]), (1, LANDINGS[1])] {
        lift.run_until(12_000, |lift| !lift.is_lit());
        assert!(lift.position().abs_diff(position.into()) <= 1, "{} for {position}", lift.position());
        lift.run_until(1000, |lift| lift.doors_are(car::WIDTH));
        if landing == 4 {
            lift.write(LOAD, 0x2320, 2, &call(1).to_le_bytes()[..6]);
            lift.press_button();
        }
    }
    let fastest = lift.log.iter().filter_map(|stamped| velocity(&from_bus(&stamped.frame)?));
    let (slowest, fastest) = fastest.fold((0, 0), |(low, high), v| (v.min(low), v.max(high)));
    assert_eq!((slowest, fastest), (-FAST, FAST));
}

/// The actual velocity, if the frame carries it.
fn velocity(frame: &Frame) -> Option<i32> {
    let field = by_cob_id(frame.id().into()).filter(|_| frame.id() == 0x183)?.fields().nth(3)?;
    let word = u32::try_from(field.value(frame.data())?).ok()?;
    Some(word.cast_signed())
}

/// Every position on the bus is that of the car when it was measured, to one step, and at most a millisecond old.
fn every_position_is_that_of_the_car(lift: &SmallLift) {
    let world = lift.world.borrow();
    let (mut frames, mut worst) = (0, 0.0_f64);
    for stamped in &lift.log {
        let Some(frame) = from_bus(&stamped.frame).filter(|frame| frame.id() == 0x18C) else { continue };
        let position = f64::from(u32::from_le_bytes(frame.data().try_into().unwrap()));
        let at = stamped.at.as_micros();
        let count = world.measured.partition_point(|(time, _)| time.0 < at);
        let (measured, car) = world.measured[count - 1];
        // The preset made 10 m of a position 3 m from the end of the tape.
        let error = position - (car + 7_000.0);
        assert!(error.abs() <= 1.0, "{position} at {at} us, when the car was at {car}");
        assert!(at - measured.0 <= 1000);
        (frames, worst) = (frames + 1, worst.max(error.abs()));
    }
    println!("{frames} positions, none more than {worst:.2} mm from the car");
    assert!(frames > 7_000, "one a millisecond while it drives: {frames}");
}

/// The display takes the state of the position unit from that unit's multiplexed PDO, and ignores the unit's other
/// objects.
fn the_display_shows_the_values_of_its_lift(lift: &mut SmallLift) {
    assert_eq!(lift.shown(0x2303, 1), 0, "within its limits");
    // Ten metres a second: a jump of the car would be a fault of the encoder.
    for _ in 0..270 {
        lift.world.borrow_mut().car -= 10.0;
        lift.run(1);
    }
    lift.run(10);
    assert_eq!(lift.shown(0x2303, 1), u64::from(UNDERFLOW), "below them");
}

/// A multiplexed PDO from the call controller to all nodes lights the lamp.
fn the_lamp_can_be_lit_by_a_multiplexed_pdo(lift: &mut SmallLift) {
    assert!(!lift.is_lit());
    let lamp = Mpdo {
        address: Address::Destination(None),
        at: Multiplexer { index: 0x2322, sub: 1 },
        data: [1, 0, 0, 0],
    };
    lift.network.transmit(&Frame::new(0x500 + u16::from(CONTROLLER), &lamp.encode()).unwrap());
    lift.run(5);
    assert!(lift.is_lit());
}

/// The firmware on emulated boards: a call with an overload, then two floors up at full speed.
#[cfg(feature = "board")]
#[test]
fn a_small_lift_of_boards() {
    let mut lift = boards::Boards::new();
    lift.describe_position_unit();
    lift.run(5);
    lift.preset();
    lift.describe_load_and_panel();
    lift.write(LOAD, 0x2320, 2, &call(2).to_le_bytes()[..6]);
    lift.save();
    assert_eq!(lift.read(POSITION, 0x1000, 0), 0x0600_01A1, "a car position unit");
    assert_eq!(lift.read(POSITION, 0x6383, 1), u64::from(LANDINGS[0]), "the preset outlives the reset");
    lift.log.clear();

    lift.load(700.0);
    lift.nmt(1, 0);
    lift.run(300);
    let signals = u64::from(HALF_LOAD | FULL_LOAD | OVERLOAD);
    assert_eq!(lift.last(0x188, 0), signals);
    assert!(lift.last(0x188, 1).abs_diff(700) <= 5, "{} kg", lift.last(0x188, 1));
    assert!(!lift.is_lit());
    lift.press_button();
    assert!(lift.is_lit(), "the call is taken, and the pin of lamp 1 is high");
    lift.run(700);
    assert!(lift.doors_are(car::WIDTH), "an overload");

    lift.load(300.0);
    lift.run_until(2000, |lift| lift.doors_are(0.0));
    lift.run_until(6000, |lift| !lift.is_lit());
    assert!(lift.last(0x18C, 0).abs_diff(LANDINGS[2].into()) <= 1, "{}", lift.last(0x18C, 0));
    lift.run_until(1000, |lift| lift.doors_are(car::WIDTH));

    every_frame_is_known(&lift.log);
    every_position_is_one_that_the_car_has_just_had(&lift);
    let velocities = lift.log.iter().filter_map(|stamped| velocity(&from_bus(&stamped.frame)?));
    assert_eq!(velocities.max(), Some(FAST));
}

/// Every position on the bus is one that the car has just had, to one measuring step. At full speed the car is ahead by
/// its way between the sample and the end of the frame. This way is shorter than that of one sample period, and the
/// same each time to one step.
#[cfg(feature = "board")]
fn every_position_is_one_that_the_car_has_just_had(lift: &boards::Boards) {
    let (mut frames, mut ahead) = (0, vec![]);
    for (at, position) in boards::positions(&lift.log) {
        let before = canopen::Instant(at.0 - boards::OLDEST.0);
        // The preset made 10 m of a position 3 m from the end of the tape.
        let [oldest, newest] = [before, at].map(|at| lift.car(at) + 7_000.0);
        let (low, high) = (oldest.min(newest) - 1.0, oldest.max(newest) + 1.0);
        assert!((low..=high).contains(&position), "{position} at {at:?}, not {low} to {high}");
        let is_fast = newest - oldest > 0.999 * boards::OLDEST.0 as f64 * 1e-6 * f64::from(FAST);
        ahead.extend(is_fast.then_some(newest - position));
        frames += 1;
    }
    let least = ahead.iter().copied().fold(f64::MAX, f64::min);
    let most = ahead.iter().copied().fold(f64::MIN, f64::max);
    println!("{frames} positions; at 2.5 m/s the car is {least:.2} to {most:.2} mm ahead");
    assert!(frames > 2_500, "one a millisecond while it drives: {frames}");
    assert!(ahead.len() > 300 && most - least <= 1.0, "{least} to {most} mm in {} frames", ahead.len());
}
