//! Tests of updates of nodes that work, that fail, and that are lost halfway.

use canopen::{Duration, Instant, NodeId};
use nodectl::sdo;
use nodectl::update::{Error, Image, ImageInfo, Options, Outcome, Step, Version, Watcher, update};

use crate::loader::{Loader, identification};
use crate::wire::{Fate, Wire};

/// The reports of an update.
#[derive(Default)]
pub(crate) struct Diary {
    steps: Vec<(u8, Step)>,
    done: usize,
}

impl Watcher for Diary {
    fn step(&mut self, node: NodeId, step: Step) {
        self.steps.push((node.get(), step));
    }

    fn progress(&mut self, _: NodeId, done: usize, total: usize) {
        assert!(done <= total);
        self.done = done;
    }
}

impl Diary {
    pub(crate) fn steps_of(&self, node: u8) -> Vec<Step> {
        self.steps.iter().filter(|(of, _)| *of == node).map(|(_, step)| *step).collect()
    }
}

type Results = Vec<(NodeId, Result<Outcome, Error>)>;

const ALL: [Step; 6] = [Step::Identify, Step::Stop, Step::Clear, Step::Download, Step::Verify, Step::Start];

/// A program of this version.
pub(crate) fn program(version: &str) -> Vec<u8> {
    let mut program = format!("{version}\n").into_bytes();
    program.extend((0..20_000_u32).map(|byte| (byte % 253) as u8));
    program
}

pub(crate) fn image(version: Version) -> Image {
    let bytes = program(&version.to_string());
    let info = ImageInfo { board: 42, version, identification: identification(&bytes) };
    Image { bytes, info: Some(info) }
}

const OLD: Version = Version { major: 1, minor: 0, patch: 0 };
pub(crate) const NEW: Version = Version { major: 1, minor: 1, patch: 0 };

pub(crate) fn options() -> Options {
    let sdo = sdo::Options { timeout: Duration::from_millis(500), ..sdo::Options::default() };
    Options { sdo, patience: Duration::from_millis(20_000), force: false, key: None, confirm: true }
}

pub(crate) fn nodes(ids: &[u8]) -> Vec<NodeId> {
    ids.iter().filter_map(|&id| NodeId::new(id)).collect()
}

pub(crate) fn fleet(ids: &[u8]) -> Wire<Vec<Loader>> {
    Wire::new(ids.iter().map(|&id| Loader::new(id, &program("1.0.0"))).collect())
}

fn run(wire: &Wire<Vec<Loader>>, ids: &[u8], image: &Image, options: &Options, diary: &mut Diary) -> Results {
    update(&mut wire.network(), &nodes(ids), image, options, diary)
}

/// Updates node 3 alone.
pub(crate) fn one(
    wire: &Wire<Vec<Loader>>,
    image: &Image,
    options: &Options,
    diary: &mut Diary,
) -> Result<Outcome, Error> {
    let [(_, result)] = run(wire, &[3], image, options, diary).try_into().expect("one result");
    result
}

pub(crate) fn commands(wire: &Wire<Vec<Loader>>) -> Vec<u8> {
    wire.station(|loaders| loaders[0].flash().commands.clone())
}

#[test]
fn the_sequence_of_cia_302() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    let outcome = one(&wire, &image(NEW), &options(), &mut diary).unwrap();
    assert_eq!(diary.steps_of(3), ALL);
    assert_eq!(commands(&wire), [0, 3, 1]);
    assert_eq!(diary.done, program("1.1.0").len());
    assert_eq!(
        outcome,
        Outcome {
            old_version: Some("1.0.0".into()),
            old_identification: Some(identification(&program("1.0.0"))),
            new_version: Some("1.1.0".into()),
            new_identification: Some(identification(&program("1.1.0"))),
            is_changed: true,
            is_on_trial: false,
        }
    );
}

/// The key of a node that demands an authorisation.
const KEY: [u8; 32] = [0x5A; 32];

pub(crate) fn with_key() -> Options {
    Options { key: Some("5A".repeat(32).parse().unwrap()), ..options() }
}

#[test]
fn the_key_holder_updates_and_confirms_a_guarded_node() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    wire.station(|loaders| {
        loaders[0].set_key(KEY);
        loaders[0].flash().has_trials = true;
    });
    let outcome = one(&wire, &image(NEW), &with_key(), &mut diary).unwrap();
    assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"));
    assert!(outcome.is_changed && !outcome.is_on_trial);
    assert_eq!(commands(&wire), [0, 3, 1]);
}

#[test]
fn without_the_key_of_a_node_nothing_is_changed() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    wire.station(|loaders| loaders[0].set_key(KEY));
    // Also where another master has opened the node: it is closed again when the new program is to be confirmed.
    for is_open in [false, true] {
        wire.station(|loaders| loaders[0].flash().challenge(is_open));
        let error = one(&wire, &image(NEW), &options(), &mut diary).unwrap_err();
        assert!(matches!(error, Error::Closed { .. }), "{is_open}: {error}");
    }
    wire.station(|loaders| loaders[0].flash().challenge(false));
    let other = Options { key: Some("5B".repeat(32).parse().unwrap()), ..options() };
    let error = one(&wire, &image(NEW), &other, &mut diary).unwrap_err();
    assert!(error.to_string().contains("Program authorisation: response"), "{error}");
    assert!(commands(&wire).is_empty());
    assert!(!diary.steps_of(3).contains(&Step::Stop));
}

#[test]
fn a_program_on_trial_is_confirmed_unless_that_is_not_wanted() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    wire.station(|loaders| loaders[0].flash().has_trials = true);
    let outcome = one(&wire, &image(NEW), &options(), &mut diary).unwrap();
    assert!(!outcome.is_on_trial && !wire.station(|loaders| loaders[0].flash().is_on_trial));
    assert_eq!(diary.steps_of(3).last(), Some(&Step::Confirm));
    let left = Options { confirm: false, force: true, ..options() };
    let outcome = one(&wire, &image(OLD), &left, &mut Diary::default()).unwrap();
    assert!(outcome.is_on_trial && wire.station(|loaders| loaders[0].flash().is_on_trial));
    let error = one(&wire, &image(NEW), &options(), &mut Diary::default()).unwrap_err();
    assert!(matches!(error, Error::OnTrial { .. }), "another program is refused: {error}");
    assert_eq!(commands(&wire).last(), Some(&1), "the program runs");
    // A later update that finds the program on the node ends its trial.
    let outcome = one(&wire, &image(OLD), &options(), &mut Diary::default()).unwrap();
    assert!(!outcome.is_on_trial && !outcome.is_changed);
    assert!(!wire.station(|loaders| loaders[0].flash().is_on_trial));
}

#[test]
fn a_node_that_has_taken_the_program_back_says_why() {
    let wire = fleet(&[3]);
    wire.station(|loaders| loaders[0].flash().takes_back = Some(program("1.0.0")));
    let error = one(&wire, &image(NEW), &options(), &mut Diary::default()).unwrap_err();
    assert!(
        error.to_string().ends_with(
            "the new program started three times without being confirmed; the previous program runs again"
        ),
        "{error}"
    );
}

#[test]
fn an_image_that_says_nothing_of_itself() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    let outcome = one(&wire, &Image::opaque(program("9.9.9")), &options(), &mut diary).unwrap();
    assert_eq!((diary.steps_of(3), outcome.new_version.as_deref()), (ALL.to_vec(), Some("9.9.9")));
}

#[test]
fn a_node_with_the_same_program_is_updated_only_by_force() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    let outcome = one(&wire, &image(OLD), &options(), &mut diary).unwrap();
    assert!(!outcome.is_changed);
    assert_eq!((diary.steps_of(3), commands(&wire)), (vec![Step::Identify], vec![]));
    let force = Options { force: true, ..options() };
    let outcome = one(&wire, &image(OLD), &force, &mut Diary::default()).unwrap();
    assert!(outcome.is_changed);
    assert_eq!(commands(&wire), [0, 3, 1]);
}

#[test]
fn unsuitable_images_are_refused_before_any_erase() {
    let wire = fleet(&[3]);
    let mut other = image(NEW);
    other.info.as_mut().unwrap().board = 43;
    let error = one(&wire, &other, &options(), &mut Diary::default()).unwrap_err();
    assert_eq!(error.to_string(), "node 3: the image is for board 0000002Bh, the node has board 0000002Ah");
    let older = image(Version { major: 0, minor: 9, patch: 0 });
    let error = one(&wire, &older, &options(), &mut Diary::default()).unwrap_err();
    assert_eq!(error.to_string(), "node 3: the node runs version 1.0.0, which is newer than 0.9.0");
    assert!(commands(&wire).is_empty());
    let force = Options { force: true, ..options() };
    assert_eq!(
        one(&wire, &older, &force, &mut Diary::default()).unwrap().new_version.as_deref(),
        Some("0.9.0")
    );
    assert!(matches!(one(&wire, &other, &force, &mut Diary::default()), Err(Error::Board { .. })));
}

#[test]
fn a_node_without_blocks_gets_segments() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    wire.station(|loaders| loaders[0].flash().has_blocks = false);
    one(&wire, &image(NEW), &options(), &mut diary).unwrap();
    assert!(diary.steps_of(3).contains(&Step::DownloadSegments));
    assert_eq!(wire.station(|loaders| loaders[0].flash().program.clone()), program("1.1.0"));
}

#[test]
fn a_refused_program_is_reported_in_words() {
    for (word, words) in [
        (0x0006, "format or CRC error"),
        (0x000E, "the flash is secured"),
        (0x0005_0080, "the image is for another board"),
    ] {
        let wire = fleet(&[3]);
        wire.station(|loaders| loaders[0].flash().verdict = word);
        let error = one(&wire, &image(NEW), &options(), &mut Diary::default()).unwrap_err();
        let text = error.to_string();
        assert!(text.starts_with("node 3, 1F57h:1 \"Flash status identification\": "), "{text}");
        assert!(matches!(error, Error::Flash { .. }) && text.contains(words), "{text}");
        assert_eq!(commands(&wire), [0, 3], "it must not be started");
    }
}

#[test]
fn another_identification_than_that_of_the_image_is_not_started() {
    let wire = fleet(&[3]);
    let mut wrong = image(NEW);
    wrong.info.as_mut().unwrap().identification ^= 1;
    let error = one(&wire, &wrong, &options(), &mut Diary::default()).unwrap_err();
    assert!(matches!(error, Error::Identification { .. }), "{error}");
    assert_eq!(commands(&wire), [0, 3]);
}

#[test]
fn a_bus_that_breaks_at_any_frame_is_opened_again_and_the_update_gone_on_with() {
    // The bus breaks at one frame of the update, and that for every 97th frame: trying all frames would take too long.
    let count = std::rc::Rc::new(std::cell::Cell::new(0));
    let (wire, seen) = (fleet(&[3]), count.clone());
    wire.disturb(move |_| {
        seen.set(seen.get() + 1);
        Fate::Arrives
    });
    one(&wire, &image(NEW), &options(), &mut Diary::default()).unwrap();
    assert!(count.get() > 2900);
    for breaks in (20..count.get()).step_by(97) {
        let (wire, mut diary, mut number) = (fleet(&[3]), Diary::default(), 0);
        wire.disturb(move |_| {
            number += 1;
            if number == breaks { Fate::BreaksTheBus } else { Fate::Arrives }
        });
        let outcome = one(&wire, &image(NEW), &options(), &mut diary).unwrap();
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"), "{breaks}");
        assert_eq!(outcome.old_version.as_deref(), Some("1.0.0"), "{breaks}");
        assert!(diary.steps_of(3).contains(&Step::Back), "{breaks}");
        assert_eq!(wire.station(|loaders| loaders[0].flash().program.clone()), program("1.1.0"));
    }
}

/// Switches a node off for a while when a part of the program has arrived.
struct Switch<'a> {
    wire: &'a Wire<Vec<Loader>>,
    diary: Diary,
    node: u8,
    until: Instant,
    is_done: bool,
}

impl Watcher for Switch<'_> {
    fn step(&mut self, node: NodeId, step: Step) {
        self.diary.step(node, step);
    }

    fn progress(&mut self, node: NodeId, done: usize, total: usize) {
        self.diary.progress(node, done, total);
        if node.get() == self.node && done > total / 2 && !self.is_done {
            self.is_done = true;
            let until = self.until;
            self.wire.station(|loaders| {
                let loader = loaders.iter_mut().find(|loader| loader.id() == node);
                loader.expect("the node").switch_off(until);
            });
        }
    }
}

fn switched_off(until: Instant) -> (Diary, Results) {
    let wire = fleet(&[3, 4, 5, 6]);
    let mut switch = Switch { wire: &wire, diary: Diary::default(), node: 4, until, is_done: false };
    let results = update(&mut wire.network(), &nodes(&[3, 4, 5, 6]), &image(NEW), &options(), &mut switch);
    (switch.diary, results)
}

#[test]
fn four_nodes_of_which_one_is_switched_off_halfway_and_gone_on_with() {
    // The node is off for longer than an update waits while others have their turn.
    let (diary, results) = switched_off(Instant(40_000_000));
    let order: Vec<u8> = results.iter().map(|(node, _)| node.get()).collect();
    assert_eq!(order, [3, 5, 6, 4]);
    for (node, result) in results {
        let outcome = result.unwrap_or_else(|error| panic!("node {}: {error}", node.get()));
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"));
        assert_eq!(outcome.old_version.as_deref(), Some("1.0.0"));
    }
    let steps = diary.steps_of(4);
    assert_eq!(steps.iter().filter(|step| **step == Step::Download).count(), 2);
    assert!(steps.ends_with(&[Step::Clear, Step::Download, Step::Verify, Step::Start]), "{steps:?}");
}

/// The node has another challenge after it was off.
#[test]
fn a_guarded_node_that_is_switched_off_halfway_is_gone_on_with() {
    let wire = fleet(&[3]);
    wire.station(|loaders| loaders[0].set_key(KEY));
    let until = Instant(20_000_000);
    let mut switch = Switch { wire: &wire, diary: Diary::default(), node: 3, until, is_done: false };
    let results = update(&mut wire.network(), &nodes(&[3]), &image(NEW), &with_key(), &mut switch);
    let [(_, result)] = results.try_into().expect("one result");
    assert_eq!(result.unwrap().new_version.as_deref(), Some("1.1.0"));
    assert!(switch.diary.steps_of(3).contains(&Step::Back));
}

/// Switches node 3 off when the download is complete, within the copy of the new program.
struct SwitchInCopy<'a> {
    wire: &'a Wire<Vec<Loader>>,
    diary: Diary,
}

impl Watcher for SwitchInCopy<'_> {
    fn step(&mut self, node: NodeId, step: Step) {
        self.diary.step(node, step);
        if step == Step::Verify {
            self.wire.station(|loaders| loaders[0].switch_off_within_copy(Instant(20_000_000)));
        }
    }

    fn progress(&mut self, node: NodeId, done: usize, total: usize) {
        self.diary.progress(node, done, total);
    }
}

/// The loader finishes the copy and starts the new program by itself.
#[test]
fn a_node_that_is_switched_off_within_the_copy_is_not_updated_twice() {
    for is_guarded in [false, true] {
        let wire = fleet(&[3]);
        if is_guarded {
            wire.station(|loaders| loaders[0].set_key(KEY));
        }
        let mut switch = SwitchInCopy { wire: &wire, diary: Diary::default() };
        let results = update(&mut wire.network(), &nodes(&[3]), &image(NEW), &with_key(), &mut switch);
        let [(_, result)] = results.try_into().expect("one result");
        let outcome = result.unwrap();
        assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"), "{is_guarded}");
        assert_eq!(outcome.old_version.as_deref(), Some("1.0.0"), "{is_guarded}");
        let steps = switch.diary.steps_of(3);
        assert_eq!(steps.iter().filter(|step| **step == Step::Download).count(), 1, "{steps:?}");
        assert_eq!(wire.station(|loaders| loaders[0].flash().erased), 1, "{is_guarded}");
    }
}

#[test]
fn a_node_whose_loader_starts_the_old_program_by_itself_is_stopped_again() {
    let (wire, mut diary) = (fleet(&[3]), Diary::default());
    wire.station(|loaders| loaders[0].flash().starts_before = Some(3));
    let outcome = one(&wire, &image(NEW), &options(), &mut diary).unwrap();
    assert_eq!(outcome.new_version.as_deref(), Some("1.1.0"));
    assert_eq!(commands(&wire), [0, 3, 0, 3, 1]);
}

#[test]
fn a_node_that_stays_away_does_not_keep_the_others_from_it() {
    let (_, results) = switched_off(Instant::NEVER);
    let failed: Vec<u8> =
        results.iter().filter(|(_, result)| result.is_err()).map(|(node, _)| node.get()).collect();
    assert_eq!(failed, [4]);
    let (_, Err(error)) = results.last().unwrap() else { panic!() };
    assert_eq!(error.to_string(), "node 4: lost, and not back within 20 s");
}

#[test]
fn a_node_that_was_never_there_is_no_answer_at_once() {
    let wire = fleet(&[3]);
    let results = run(&wire, &[9], &image(NEW), &options(), &mut Diary::default());
    let [(_, Err(error))] = &results[..] else { panic!("{results:?}") };
    assert_eq!(error.to_string(), "node 9, 1F51h:1 \"Program control\": no answer");
}
