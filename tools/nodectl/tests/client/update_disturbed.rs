//! Updates of nodes while the bus is lost, the power fails, or another master uses the same SDO server.

use std::cell::Cell;
use std::rc::Rc;

use canopen::{Duration, Frame, Instant, Transmit};
use nodectl::bus::Station;
use nodectl::update::{Error, Step, update};

use crate::loader::Loader;
use crate::update::{Diary, NEW, commands, fleet, image, nodes, one, options, program, with_key};
use crate::wire::{Fate, Wire};

/// Breaks the bus once, in the download to the first node.
fn break_once(wire: &Wire<Vec<Loader>>) {
    let mut count = 0;
    wire.disturb(move |_| {
        count += 1;
        if count == 1000 { Fate::BreaksTheBus } else { Fate::Arrives }
    });
}

#[test]
fn all_nodes_wait_for_a_bus_that_is_lost() {
    let wire = fleet(&[3, 4, 5]);
    break_once(&wire);
    // Longer than the time of a lost node while others wait.
    let mut network = wire.network_back_after(9);
    let results = update(&mut network, &nodes(&[3, 4, 5]), &image(NEW), &options(), &mut Diary::default());
    for (node, result) in results {
        let outcome = result.unwrap_or_else(|error| panic!("node {}: {error}", node.get()));
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"));
    }
}

#[test]
fn a_bus_that_does_not_come_back_is_waited_for_once() {
    let wire = fleet(&[3, 4, 5]);
    break_once(&wire);
    let mut network = wire.network_back_after(usize::MAX);
    let begin = network.now();
    let results = update(&mut network, &nodes(&[3, 4, 5]), &image(NEW), &options(), &mut Diary::default());
    assert_eq!(results.len(), 3);
    for (_, result) in results {
        assert!(result.unwrap_err().to_string().ends_with("the bus is lost: unplugged"));
    }
    assert!(network.now().0 - begin.0 < 27_000_000, "{:?}", network.now());
}

#[test]
fn a_node_that_loses_its_power_just_after_the_stop_is_stopped_again() {
    for is_guarded in [false, true] {
        let wire = fleet(&[3]);
        wire.station(|loaders| loaders[0].flash().power_cuts = 1);
        if is_guarded {
            wire.station(|loaders| loaders[0].set_key([0x5A; 32]));
        }
        let outcome = one(&wire, &image(NEW), &with_key(), &mut Diary::default()).unwrap();
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"));
        assert_eq!(commands(&wire), [0, 0, 3, 1], "{is_guarded}");
    }
}

#[test]
fn a_node_that_never_stops_its_program_is_given_up() {
    let wire = fleet(&[3]);
    wire.station(|loaders| loaders[0].flash().power_cuts = usize::MAX);
    let error = one(&wire, &image(NEW), &options(), &mut Diary::default()).unwrap_err();
    assert!(matches!(error, Error::Stuck { .. }), "{error}");
    assert_eq!(error.to_string(), "node 3: it does not stop its program");
    assert_eq!(commands(&wire), [0, 0, 0]);
}

/// A node, and another master that reads its 1000h every 100 ms. The frames of the transfer are only heard here.
struct Visited {
    loader: Loader,
    next: Instant,
}

impl Station for Visited {
    fn receive(&mut self, frame: &Frame, now: Instant, out: &mut impl Transmit) {
        self.loader.receive(frame, now, out);
    }

    fn poll(&mut self, now: Instant, out: &mut impl Transmit) -> Instant {
        if now >= self.next {
            self.next = now + Duration::from_millis(100);
            for (id, data) in
                [(0x603, [0x40, 0, 0x10, 0, 0, 0, 0, 0]), (0x583, [0x43, 0, 0x10, 0, 0x94, 1, 2, 0])]
            {
                out.send(Frame::new(id, &data).expect("a frame")).expect("room");
            }
        }
        self.loader.poll(now, out).min(self.next)
    }
}

/// The node acknowledges neither stop nor start.
#[test]
fn answers_to_another_master_do_not_end_an_update_and_its_transfers_are_not_aborted() {
    let wire = Wire::new(Visited { loader: Loader::new(3, &program("1.0.0")), next: Instant(0) });
    let aborts = Rc::new(Cell::new(0));
    let seen = Rc::clone(&aborts);
    wire.disturb(move |frame| {
        seen.set(seen.get() + usize::from(frame.id() == 0x603 && frame.data()[0] == 0x80));
        Fate::Arrives
    });
    let mut network = wire.network();
    let results = update(&mut network, &nodes(&[3]), &image(NEW), &options(), &mut Diary::default());
    let [(_, result)] = results.try_into().expect("one result");
    assert_eq!(result.unwrap().new_version.as_deref(), Some("1.1.0"));
    assert_eq!(wire.station(|visited| visited.loader.flash().commands.clone()), [0, 3, 1]);
    assert_eq!(aborts.get(), 0);
}

/// A server that takes segments twice sees more data than announced, or another CRC.
#[test]
fn a_download_that_was_mixed_up_is_begun_again() {
    for code in [0x0607_0012_u32, 0x0504_0004, 0x0504_0001] {
        let (wire, mut diary) = (fleet(&[3]), Diary::default());
        let mut count = 0;
        wire.disturb(move |frame| {
            count += usize::from(frame.data().first() == Some(&0xA2));
            if count != 3 || frame.data()[0] != 0xA2 {
                return Fate::Arrives;
            }
            let [a, b, c, d] = code.to_le_bytes();
            Fate::BecomesAnother(Frame::new(0x583, &[0x80, 0x50, 0x1F, 1, a, b, c, d]).expect("a frame"))
        });
        let outcome = one(&wire, &image(NEW), &options(), &mut diary).unwrap();
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"), "{code:X}");
        assert!(!diary.steps_of(3).contains(&Step::DownloadSegments), "{code:X}");
    }
}

/// Another master has downloaded its program after this one has stopped the node.
#[test]
fn a_node_with_the_complete_download_of_another_master_is_started() {
    for version in ["1.1.0", "1.2.0"] {
        let wire = fleet(&[3]);
        wire.station(|loaders| loaders[0].flash().other_download = Some(program(version)));
        let result = one(&wire, &image(NEW), &options(), &mut Diary::default());
        assert_eq!(commands(&wire), [0, 3, 1], "{version}");
        match (version, result) {
            ("1.1.0", Ok(outcome)) => assert_eq!(outcome.new_version.as_deref(), Some("1.1.0")),
            ("1.2.0", Err(Error::OtherDownload { .. })) => {}
            (_, result) => panic!("{version}: {result:?}"),
        }
    }
}
