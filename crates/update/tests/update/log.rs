//! The events of updates, from the records in staging.

use crate::bench::{
    confirm, download, flash_with, image_a, image_b, install, run, start, start_after, target, update,
};
use update::mock::{MockFlash, Weak};
use update::{Cause, Event, Log, Outcome, Refusal, Reset, Status, Trial, Updater};

/// A start of the application: it logs what is pending, as the firmware does.
fn look(flash: &mut MockFlash, log: &mut Log) {
    let layout = target().layout;
    if let Some(event) = Event::pending(flash, &layout) {
        log.add(&event);
        event.settle(flash, &layout);
    }
    assert_eq!(Event::pending(flash, &layout), None, "an event is logged once");
}

/// The outcomes with the major version of the image, the oldest first.
fn outcomes(log: &Log) -> Vec<(Outcome, u16)> {
    let mut events: Vec<_> = log.events().map(|event| (event.outcome, event.version.major)).collect();
    events.reverse();
    events
}

#[test]
fn each_update_leaves_its_events_with_version_and_reason() {
    let (mut flash, mut log) = (flash_with(&image_a(), 1), Log::EMPTY);
    let layout = target().layout;
    look(&mut flash, &mut log);
    // Confirmed by a master.
    update(&mut flash, &image_b().bytes()).unwrap();
    start(&mut flash);
    look(&mut flash, &mut log);
    confirm(&mut flash);
    Cause::Command.note(&mut flash, &layout);
    look(&mut flash, &mut log);
    // Not confirmed in time.
    update(&mut flash, &image_a().bytes()).unwrap();
    start(&mut flash);
    look(&mut flash, &mut log);
    Trial::withdraw(&mut flash, &layout).unwrap();
    Cause::Time.note(&mut flash, &layout);
    start(&mut flash);
    look(&mut flash, &mut log);
    // Three starts, of which the program has seen none for long enough to log it.
    update(&mut flash, &image_a().bytes()).unwrap();
    for _ in 0..3 {
        start_after(&mut flash, Reset::Crash);
    }
    look(&mut flash, &mut log);
    // Refused.
    let mut unsigned = image_a().bytes();
    unsigned[450] ^= 1;
    assert!(download(&mut Updater::new(&mut flash, target(), Status::GOOD), &unsigned).is_err());
    look(&mut flash, &mut log);
    // Broken off.
    let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
    updater.clear().unwrap();
    run(&mut updater).unwrap();
    updater.begin(None).unwrap();
    updater.receive(&image_a().bytes()[..600]).unwrap();
    look(&mut flash, &mut log);
    let Outcome::Refused(refused) = outcomes(&log)[6].0 else { panic!("{log:?}") };
    assert_eq!(refused, Status::refused(Refusal::HeaderCrc));
    assert_eq!(
        outcomes(&log),
        [
            (Outcome::Installed, 1),
            (Outcome::OnTrial, 2),
            (Outcome::Confirmed(Cause::Command), 2),
            (Outcome::OnTrial, 1),
            (Outcome::Withdrawn(Cause::Time), 1),
            (Outcome::Failed, 1),
            (Outcome::Refused(refused), 0),
            (Outcome::BrokenOff, 1),
        ]
    );
}

/// The power fails at each operation on the flash; in the end the log has the events, and none that was not.
#[test]
fn a_power_cut_costs_at_most_the_reason() {
    let (before, layout) = (flash_with(&image_a(), 1), target().layout);
    let mut cuts = 0;
    for (weak, cut) in Weak::ALL.into_iter().flat_map(|weak| (0..60).map(move |cut| (weak, cut))) {
        let (mut flash, mut log) = (before.clone(), Log::EMPTY);
        look(&mut flash, &mut log);
        flash.cut_after(cut * 3, weak);
        let mut updater = Updater::new(&mut flash, target(), Status::GOOD);
        let is_staged = download(&mut updater, &image_b().bytes()).is_ok() && install(&mut flash).is_ok();
        cuts += u32::from(flash.is_down());
        flash.power_up();
        start(&mut flash);
        look(&mut flash, &mut log);
        if Trial::read(&mut flash, &layout) == Trial::Open {
            flash.cut_after(cut % 4, weak);
            let _ = Trial::confirm(&mut flash, &layout);
            Cause::Command.note(&mut flash, &layout);
            flash.power_up();
            let _ = Trial::confirm(&mut flash, &layout);
            start(&mut flash);
            look(&mut flash, &mut log);
            let events = outcomes(&log);
            let last = events.last().unwrap();
            assert!(matches!(last, (Outcome::Confirmed(Cause::Command | Cause::Unknown), 2)), "{events:?}");
            assert!(events.contains(&(Outcome::OnTrial, 2)), "{events:?}");
        } else {
            assert!(!is_staged);
            let events = outcomes(&log);
            let no_update =
                |event: &(Outcome, u16)| matches!(event.0, Outcome::Installed | Outcome::BrokenOff);
            assert!(events.iter().all(no_update), "{events:?}");
        }
    }
    println!("{cuts} cuts");
    assert!(cuts > 100);
}
