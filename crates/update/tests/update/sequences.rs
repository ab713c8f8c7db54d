//! Sequences of updates, confirmations, returns, starts and power cuts in random order, against a model that knows
//! which programs may run after each step. `SEQUENCES=2000 cargo test -p update --test update sequences` runs that many.

use update::key::KeyList;
use update::mock::{MockFlash, Weak};
use update::{Decision, Description, Refusal, Reset, Start, Status, Trial, Updater, boot};

use crate::bench::{
    Image, SECTORS, certificate, confirm, description, download, holds, install, is_thorough, key_number,
    run, start, start_after, target, update,
};

/// Steps of a sequence.
const STEPS: usize = 12;

/// The programs of all sequences: two have a higher security counter, and one has another release key.
fn programs() -> Vec<Image> {
    let about =
        [description(1, 5), description(2, 5), description(3, 6), description(4, 7), description(5, 5)];
    let mut programs = about.map(|about| Image::new(about, 8)).to_vec();
    let keys = KeyList { release: Some(certificate(1, 0, 3, 1)), root: None };
    let newer_key = Image::new(Description { keys, ..description(4, 7) }, 8);
    programs[3] = newer_key.signed_by(&key_number(3));
    programs
}

/// A program on trial.
#[derive(Clone, Copy, Debug)]
struct OnTrial {
    program: usize,
    /// Unrequested starts: those that were counted, and those whose mark may read either way after a cut.
    starts: u32,
    unsure: u32,
    is_withdrawn: bool,
    /// A withdrawal, or a confirmation, was cut.
    may_be_withdrawn: bool,
    may_be_confirmed: bool,
}

impl OnTrial {
    fn new(program: usize) -> OnTrial {
        OnTrial {
            program,
            starts: 0,
            unsure: 0,
            is_withdrawn: false,
            may_be_withdrawn: false,
            may_be_confirmed: false,
        }
    }

    /// Whether the program may run after a start.
    fn may_stay(&self) -> bool {
        // The mark of a cut start may read as set once, and the next start sets the mark after it.
        self.may_be_confirmed || !self.is_withdrawn && self.starts < 3 + self.unsure
    }

    /// Whether the previous program may run after a start.
    fn may_go(&self) -> bool {
        self.is_withdrawn || self.may_be_withdrawn || self.starts + self.unsure >= 3
    }
}

/// A program to be copied.
#[derive(Clone, Copy, Debug)]
struct Pending {
    program: usize,
    is_sure: bool,
    /// Starts that were cut: they may have been counted if the copy was complete.
    cuts: u32,
}

/// The programs of the node: the one that was confirmed last, and the one on trial.
#[derive(Clone, Debug)]
struct Model {
    confirmed: usize,
    on_trial: Option<OnTrial>,
    /// A program that was committed and not copied, or perhaps not committed if the power was cut: the next start copies
    /// it.
    pending: Option<Pending>,
}

struct Node {
    flash: MockFlash,
    model: Model,
    programs: Vec<Image>,
    random: fastrand::Rng,
    diary: Vec<String>,
    seed: u64,
}

/// Ends of an update that is broken off without a power cut.
#[derive(Clone, Copy, Debug)]
enum End {
    AfterClear,
    AfterBegin,
    InDownload,
    BeforeCheck,
    BeforeCopy,
    Never,
}

const ENDS: [End; 6] =
    [End::AfterClear, End::AfterBegin, End::InDownload, End::BeforeCheck, End::BeforeCopy, End::Never];

/// An update that is broken off. An error means that the node has refused it, or that the power is off.
fn update_until(flash: &mut MockFlash, image: &Image, end: End) -> Result<(), Refusal> {
    let bytes = image.bytes();
    let mut updater = Updater::new(&mut *flash, target(), Status::GOOD);
    match end {
        End::Never => {
            download(&mut updater, &bytes)?;
            return install(flash);
        }
        End::BeforeCopy => return download(&mut updater, &bytes),
        End::AfterClear | End::AfterBegin | End::InDownload | End::BeforeCheck => {}
    }
    updater.clear()?;
    run(&mut updater)?;
    if matches!(end, End::AfterClear) {
        return Ok(());
    }
    updater.begin(None)?;
    let part = match end {
        End::AfterBegin => 0,
        End::InDownload => bytes.len() / 2,
        _ => bytes.len(),
    };
    updater.receive(&bytes[..part])
}

impl Node {
    fn new(seed: u64) -> Node {
        let programs = programs();
        let mut flash = MockFlash::new(&SECTORS, seed);
        update(&mut flash, &programs[0].bytes()).unwrap();
        let model = Model { confirmed: 0, on_trial: None, pending: None };
        let mut node =
            Node { flash, model, programs, random: fastrand::Rng::with_seed(seed), diary: Vec::new(), seed };
        node.settle(Reset::Asked);
        node
    }

    fn told(&self) -> String {
        format!("seed {}: {:#?}\n{:?}", self.seed, self.diary, self.model)
    }

    fn note(&mut self, what: String) {
        self.diary.push(what);
    }

    /// Carries out `act`, in one of three cases with a power cut at a random operation. Returns whether it was cut, and
    /// the result.
    fn cut<T>(&mut self, act: impl Fn(&mut MockFlash) -> T) -> (bool, T) {
        let mut whole = self.flash.clone();
        act(&mut whole);
        let operations = whole.operations() - self.flash.operations();
        if operations > 0 && self.random.u8(..3) == 0 {
            let weak = *self.random.choice(&Weak::ALL).unwrap();
            // The first and the last operations decide.
            let at = match self.random.u8(..3) {
                0 => self.random.u32(..operations.min(8)),
                1 => operations - 1 - self.random.u32(..operations.min(8)),
                _ => self.random.u32(..operations),
            };
            self.flash.cut_after(at, weak);
            self.note(format!("  cut at {at} of {operations}, {weak:?}"));
        }
        let result = act(&mut self.flash);
        let is_cut = self.flash.is_down();
        if is_cut {
            self.flash.power_up();
        }
        (is_cut, result)
    }

    fn step(&mut self) {
        match self.random.u8(..10) {
            0..=3 => self.update(),
            4 => self.confirm(),
            5 => self.withdraw(),
            6 => self.settle(Reset::Asked),
            7 => self.settle(Reset::Crash),
            _ => self.settle(Reset::Power),
        }
    }

    fn update(&mut self) {
        let number = self.random.usize(..self.programs.len());
        let end = *self.random.choice(&ENDS).unwrap();
        let image = self.programs[number].clone();
        self.note(format!("update to {number}, broken off {end:?}"));
        // The bootloader has decided before it takes commands.
        let (before, open) = (self.flash.clone(), self.model.on_trial);
        boot(&mut self.flash, &target(), Start { stay: true, ..Start::default() });
        let (is_cut, result) = self.cut(|flash| update_until(flash, &image, end));
        let is_refused_by_trial = result == Err(Refusal::OnTrial);
        match open {
            Some(open) if is_refused_by_trial => {
                assert!(
                    !is_cut && self.flash.bytes() == before.bytes(),
                    "nothing is changed: {}",
                    self.told()
                );
                let _ = open;
            }
            Some(open) => {
                assert!(open.may_be_confirmed, "a trial is open: {}", self.told());
                self.model.confirmed = open.program;
                self.model.on_trial = None;
                self.begun(number, end, is_cut, result);
            }
            None => {
                assert!(!is_refused_by_trial, "no trial is open: {}", self.told());
                self.begun(number, end, is_cut, result);
            }
        }
        self.settle(if is_cut { Reset::Power } else { Reset::Asked });
    }

    /// The model after an update that was not refused because of a trial.
    fn begun(&mut self, number: usize, end: End, is_cut: bool, result: Result<(), Refusal>) {
        let least = self.programs[self.model.confirmed].header.counter();
        if self.programs[number].header.counter() < least {
            let is_early = matches!(end, End::AfterClear | End::AfterBegin | End::InDownload);
            assert!(is_early || result.is_err(), "an older program is refused: {}", self.told());
            return;
        }
        assert!(is_cut || result.is_ok(), "{result:?}: {}", self.told());
        match end {
            End::BeforeCopy | End::Never if is_cut => {
                self.model.pending = Some(Pending { program: number, is_sure: false, cuts: 0 });
            }
            End::BeforeCopy => {
                self.model.pending = Some(Pending { program: number, is_sure: true, cuts: 0 });
            }
            End::Never => self.model.on_trial = Some(OnTrial::new(number)),
            _ => {}
        }
    }

    fn confirm(&mut self) {
        self.note("confirm".to_owned());
        // The running program confirms itself.
        if Trial::read(&mut self.flash, &target().layout) != Trial::Open {
            return;
        }
        let (is_cut, _) = self.cut(|flash| Trial::confirm(flash, &target().layout).is_ok());
        let Some(open) = &mut self.model.on_trial else { panic!("there is no trial: {}", self.told()) };
        if is_cut {
            open.may_be_confirmed = true;
        } else {
            self.model.confirmed = open.program;
            self.model.on_trial = None;
        }
        self.settle(if is_cut { Reset::Power } else { Reset::Asked });
    }

    fn withdraw(&mut self) {
        self.note("withdraw".to_owned());
        if Trial::read(&mut self.flash, &target().layout) != Trial::Open {
            return;
        }
        let (is_cut, _) = self.cut(|flash| Trial::withdraw(flash, &target().layout).is_ok());
        let Some(open) = &mut self.model.on_trial else { panic!("there is no trial: {}", self.told()) };
        if is_cut {
            open.may_be_withdrawn = true;
        } else {
            open.is_withdrawn = true;
        }
        self.settle(if is_cut { Reset::Power } else { Reset::Asked });
    }

    /// A start, perhaps cut and then repeated. One of the programs that the model allows must run.
    fn settle(&mut self, reset: Reset) {
        self.note(format!("start after {reset:?}"));
        let mut reset = reset;
        loop {
            let (is_cut, decision) = self.cut(|flash| start_after(flash, reset));
            let is_counted = reset != Reset::Asked;
            if let Some(pending) = &mut self.model.pending {
                // The start that ends the update may have followed a complete copy.
                pending.cuts += 1;
            } else if let Some(open) = &mut self.model.on_trial {
                if is_counted && is_cut {
                    open.unsure += 1;
                } else if is_counted && !open.is_withdrawn {
                    open.starts += 1;
                }
            }
            if !is_cut {
                return self.observe(decision);
            }
            reset = Reset::Power;
        }
    }

    fn observe(&mut self, decision: Decision) {
        let Decision::Start(header) = decision else { panic!("no program: {decision:?}, {}", self.told()) };
        let number = self.programs.iter().position(|image| image.header == header).expect("a known program");
        assert!(holds(&self.flash, &self.programs[number]), "it is not whole: {}", self.told());
        self.note(format!("  {number} runs"));
        if let Some(pending) = self.model.pending.take() {
            let Pending { program, is_sure, cuts } = pending;
            let may_be = number == program || number == self.model.confirmed && (!is_sure || cuts > 3);
            assert!(may_be, "{number} may not run: {}", self.told());
            // The two may be the same program: then the state of the trial tells them apart.
            let is_open = Trial::read(&mut self.flash, &target().layout) == Trial::Open;
            if number == program && (number != self.model.confirmed || is_open) {
                self.model.on_trial = Some(OnTrial { unsure: cuts, ..OnTrial::new(program) });
            }
            return;
        }
        match self.model.on_trial {
            Some(open) => {
                let (stays, goes) = (open.may_stay(), open.may_go());
                let is_same = open.program == self.model.confirmed;
                let has_run = number == open.program && stays || number == self.model.confirmed && goes;
                // The counter of a program whose confirmation was cut may be recorded: then the previous one is refused.
                let refused = open.may_be_confirmed && number == open.program;
                assert!(has_run || refused, "{number} may not run: {}", self.told());
                let trial = Trial::read(&mut self.flash, &target().layout);
                if number != open.program || is_same && trial != Trial::Open && !open.may_be_confirmed {
                    self.model.on_trial = None;
                } else if !open.may_be_confirmed {
                    assert_eq!(trial, Trial::Open, "the trial of {number} is open: {}", self.told());
                }
            }
            None => {
                assert_eq!(number, self.model.confirmed, "{}", self.told());
                let trial = Trial::read(&mut self.flash, &target().layout);
                assert!(
                    !matches!(trial, Trial::Begun | Trial::Open | Trial::Lost(_)),
                    "{trial:?}: {}",
                    self.told()
                );
            }
        }
        if self.model.on_trial.is_none() {
            self.may_be_updated();
        }
    }

    /// Counter and keys of a program that was never confirmed are not recorded: a program with the counter of the
    /// confirmed one is accepted, and the program that a further update keeps is the confirmed one.
    fn may_be_updated(&self) {
        if !self.diary.len().is_multiple_of(4) {
            return;
        }
        let mut flash = self.flash.clone();
        let about = self.programs[self.model.confirmed].header.description();
        let key = key_number(if about.keys.generation() == 0 { 0 } else { 3 });
        let next = Image::new(Description { version: description(9, 0).version, ..about }, 8).signed_by(&key);
        update(&mut flash, &next.bytes()).unwrap_or_else(|refusal| panic!("{refusal}: {}", self.told()));
        assert_eq!(start(&mut flash), Decision::Start(next.header), "{}", self.told());
        let mut back = flash.clone();
        Trial::withdraw(&mut back, &target().layout).unwrap();
        let before = self.programs[self.model.confirmed].header;
        assert_eq!(start(&mut back), Decision::Start(before), "the kept one: {}", self.told());
        confirm(&mut flash);
        assert_eq!(start(&mut flash), Decision::Start(next.header), "{}", self.told());
    }
}

/// The seeds: a sample, as many as the variable SEQUENCES says, or the one of the variable SEED.
fn seeds() -> std::ops::Range<u64> {
    let number = |name| std::env::var(name).ok().and_then(|number| number.parse().ok());
    if let Some(seed) = number("SEED") {
        return seed..seed + 1;
    }
    0..number("SEQUENCES").unwrap_or(if is_thorough() { 2000 } else { 60 })
}

#[test]
fn after_every_step_of_a_random_sequence_an_allowed_program_runs() {
    let mut steps = 0;
    for seed in seeds() {
        let mut node = Node::new(seed);
        for _ in 0..STEPS {
            node.step();
        }
        steps += node.diary.len();
    }
    println!("{} sequences, {steps} steps, starts and cuts", seeds().count());
}

/// The trial of B is as before after an update to C that was broken off: at each place, B runs, can be confirmed, and
/// goes after three unrequested starts.
#[test]
fn an_update_that_is_broken_off_during_a_trial_does_not_end_it() {
    let [a, b, c, ..] = &programs()[..] else { panic!() };
    for end in ENDS {
        let mut flash = MockFlash::new(&SECTORS, 1);
        update(&mut flash, &a.bytes()).unwrap();
        start(&mut flash);
        update(&mut flash, &b.bytes()).unwrap();
        assert_eq!(start(&mut flash), Decision::Start(b.header));
        let _ = update_until(&mut flash, c, end);
        assert_eq!(start(&mut flash), Decision::Start(b.header), "{end:?}");
        assert_eq!(Trial::read(&mut flash, &target().layout), Trial::Open, "{end:?}");
        let mut confirmed = flash.clone();
        confirm(&mut confirmed);
        assert_eq!(start_after(&mut confirmed, Reset::Power), Decision::Start(b.header));
        for _ in 0..3 {
            start_after(&mut flash, Reset::Power);
        }
        assert_eq!(start(&mut flash), Decision::Start(a.header), "{end:?}");
    }
}
