//! Answer and effect of a save are one: what is answered with OK is there after a power cut, what is aborted has changed
//! nothing, and the memory never stays full.
//!
//! Every value is a number that only grows, so the value after a start tells which write it is of.

mod board;
mod chip;
mod waiting;

use board::{Board, DEVICE_STATE, Object};
use canopen::Duration;
use fastrand::Rng;
use host_tests::thorough;
use node::Personality;

const SAVE: u32 = u32::from_le_bytes(*b"save");
const KEY: u32 = u32::from_le_bytes(*b"cali");
const LOCK: Object = (0x2203, 0);
const SAVES_LEFT: Object = (0x2010, 1);
const ERASES: Object = (0x2010, 2);
const ERASES_ALLOWED: Object = (0x2010, 3);
const START: u8 = 1;
const PRE_OPERATIONAL: u8 = 0x80;

/// A value that is stored, and how.
#[derive(Clone, Copy)]
struct Stored {
    object: Object,
    size: u8,
    /// The command that saves the object; the object itself, if a write stores it at once.
    save: Object,
    /// The object that shows the stored value.
    shown: Object,
    /// The object that shows the value in force.
    acts: Object,
}

const fn saved(object: Object, size: u8, save: Object) -> Stored {
    Stored { object, size, save, shown: object, acts: object }
}

/// A time of a heartbeat consumer without a node-ID, and the time to confirm a program: without effect here.
const COMMUNICATION: Stored = saved((0x1016, 1), 4, (0x1010, 2));
const APPLICATION: Stored = saved((0x2002, 3), 2, (0x1010, 3));
const CALIBRATION: Stored = saved((0x2202, 1), 4, (0x2204, 0));
/// The shaft stands at 0, so the offset is the preset.
const ENCODER: Stored =
    Stored { object: (0x6003, 0), size: 4, save: (0x6003, 0), shown: (0x650C, 1), acts: (0x6004, 0) };
const LIFT: Stored =
    Stored { object: (0x6382, 1), size: 4, save: (0x6382, 1), shown: (0x2302, 1), acts: (0x6383, 1) };

impl Stored {
    fn is_preset(&self) -> bool {
        self.save == self.object
    }
}

fn all_stored(personality: Personality) -> Vec<Stored> {
    let own: &[Stored] = match personality {
        Personality::Pressure => &[CALIBRATION],
        Personality::Encoder => &[ENCODER],
        Personality::Combined => &[CALIBRATION, ENCODER],
        Personality::Lift => &[CALIBRATION, LIFT],
    };
    [&[COMMUNICATION, APPLICATION], own].concat()
}

/// The history of one value: the last that was written, and the oldest that a start may show.
#[derive(Clone, Copy, Default)]
struct Promise {
    written: u32,
    kept: u32,
}

/// A master, and what the node has promised it.
struct Master {
    board: Board,
    all: Vec<Stored>,
    promises: Vec<Promise>,
    number: u32,
    rng: Rng,
    saves: u32,
    refused: u32,
}

impl Master {
    fn new(personality: Personality, seed: u64) -> Master {
        let all = all_stored(personality);
        let mut master = Master {
            board: Board::new(personality, seed),
            promises: vec![Promise::default(); all.len()],
            all,
            // Above the defaults, which count as never written.
            number: 1000,
            rng: Rng::with_seed(seed),
            saves: 0,
            refused: 0,
        };
        master.begin();
        master
    }

    /// After each start.
    fn begin(&mut self) {
        if self.all.iter().any(|stored| stored.object == CALIBRATION.object) {
            self.board.write(LOCK, 4, KEY).unwrap();
        }
    }

    fn new_number(&mut self) -> u32 {
        self.number += 1;
        assert!(self.number < 0x1_0000, "16 bits");
        self.number
    }

    /// Writes a value that a command saves.
    fn change(&mut self, place: usize) {
        let (Stored { object, size, .. }, number) = (self.all[place], self.new_number());
        self.board.write(object, size, number).unwrap();
        self.promises[place].written = number;
    }

    /// Sends the request that stores a value, with a change before it. Returns what the node has refused at once: a
    /// refused preset has no effect.
    fn request(&mut self, place: usize) -> Result<(), u32> {
        let Stored { object, size, save, .. } = self.all[place];
        if self.all[place].is_preset() {
            let number = self.new_number();
            self.board.send(0x23 | (4 - size) << 2, object, number);
            if self.board.refusal().is_none() {
                self.promises[place].written = number;
            }
        } else {
            self.change(place);
            self.board.send(0x23, save, SAVE);
        }
        self.board.refusal().map_or(Ok(()), Err)
    }

    /// The end of a request. An OK promises the values that were written before the request.
    fn answered(&mut self, place: usize, answer: Result<u32, u32>) {
        match answer {
            Ok(_) => {
                self.saves += 1;
                self.promises[place].kept = self.promises[place].written;
            }
            Err(DEVICE_STATE) => {
                self.refused += 1;
                let Promise { written, .. } = self.promises[place];
                if written > 0 {
                    self.board.run(5);
                    let value = self.board.read(self.all[place].acts);
                    assert_eq!(value, written, "an aborted request has no effect");
                }
            }
            Err(code) => panic!("{code:08x}"),
        }
    }

    /// Stores one value, and waits. Returns whether it was accepted.
    fn store(&mut self, place: usize) -> bool {
        let _ = self.request(place);
        let answer = self.board.wait_for_response().expect("power");
        self.answered(place, answer);
        answer.is_ok()
    }

    /// After a start: every value is one that was promised, or a later one.
    fn check(&mut self) {
        for place in 0..self.all.len() {
            let value = self.board.read(self.all[place].shown);
            let Promise { written, kept } = self.promises[place];
            let was_written = value > 1000;
            assert!(
                if kept == 0 { !was_written || value <= written } else { (kept..=written).contains(&value) },
                "{:x?}: {value} after a start, {kept} was answered with OK, {written} is the last",
                self.all[place].object
            );
            self.promises[place] =
                if was_written { Promise { written: value, kept: value } } else { Promise::default() };
        }
    }

    fn restart(&mut self, cut: bool) {
        if cut {
            self.board.power_cycle();
        } else {
            self.board.reset();
        }
        self.check();
        self.begin();
    }

    /// One or two requests, the second at any moment of the first, with a change before each; sometimes a power cut.
    fn step(&mut self) {
        if self.rng.u8(..4) == 0 {
            let operations = self.rng.u32(..600);
            self.board.chip.cut_after(operations);
        }
        let mut place = self.rng.usize(..self.all.len());
        let mut is_refused = self.request(place).is_err();
        for _ in 0..self.rng.u8(..3) {
            self.board.run(self.rng.u32(..9));
            if is_refused || self.board.has_response() || self.board.chip.is_down() {
                break;
            }
            // The client continues: only the last request is answered.
            place = if self.rng.bool() { place } else { self.rng.usize(..self.all.len()) };
            is_refused = self.request(place).is_err();
        }
        match self.board.wait_for_response() {
            Some(answer) => self.answered(place, answer),
            None => return self.restart(true),
        }
        match self.rng.u8(..20) {
            _ if self.board.chip.is_down() => return self.restart(true),
            0 => self.restart(false),
            1 => self.board.nmt(START),
            2..5 => self.board.nmt(PRE_OPERATIONAL),
            _ => {}
        }
        self.board.run(self.rng.u32(..30));
        if self.board.chip.is_down() {
            self.restart(true);
        } else if self.rng.u8(..50) == 0 {
            // Without these pauses the budget of erases would be used up.
            self.board.wait(Duration::from_millis(20 * 60_000));
        }
    }
}

#[test]
fn a_save_answered_with_ok_is_there_after_a_power_cut_at_any_moment() {
    let saves = thorough::either(300, 10_000);
    for personality in Personality::ALL {
        let (mut total, mut refused, mut erases, mut seed) = (0, 0, 0, 0);
        while total < saves {
            // A new board before its numbers have more than 16 bits.
            let mut master = Master::new(personality, seed);
            while master.number < 60_000 && total + master.saves < saves {
                master.step();
            }
            (total, refused, seed) = (total + master.saves, refused + master.refused, seed + 1);
            erases += master.board.chip.erases();
        }
        println!("{personality:?}: {total} saves with OK, {refused} refused, {erases} erases");
        assert!(refused < total / 2);
    }
}

/// The node stays in one NMT state until its memory is full. Then requests are refused without effect, 2010h says so, and
/// Pre-operational makes room.
#[test]
fn no_number_of_presets_and_saves_leaves_a_memory_full_that_only_a_restart_empties() {
    let requests = thorough::either(1_000_u32, 100_000);
    for personality in Personality::ALL {
        let mut master = Master::new(personality, 1);
        let (mut full, mut used_up, mut saves) = (0, 0, 0);
        for request in 0..requests {
            if master.number > 60_000 {
                saves += master.saves;
                master = Master::new(personality, u64::from(request));
            }
            if request % 200 == 0 {
                let state = if master.rng.u8(..4) == 0 { PRE_OPERATIONAL } else { START };
                master.board.nmt(state);
            }
            let left = master.board.read(SAVES_LEFT);
            let place = master.rng.usize(..master.all.len());
            assert_eq!(master.store(place), left > 0, "2010h:1 is {left}");
            if left > 0 {
                continue;
            }
            full += 1;
            master.board.nmt(PRE_OPERATIONAL);
            master.board.run(30);
            if master.board.read(ERASES_ALLOWED) == 0 && master.board.read(SAVES_LEFT) == 0 {
                used_up += 1;
                master.board.wait(Duration::from_millis(10 * 60_000));
                master.board.run(30);
            }
            assert!(master.board.read(SAVES_LEFT) > 0, "Pre-operational has made room");
            if master.rng.u8(..8) == 0 {
                master.restart(true);
            }
            master.board.nmt(START);
        }
        let (saves, erases) = (saves + master.saves, master.board.read(ERASES));
        println!(
            "{personality:?}: {saves} of {requests} with OK, {full} times full, {used_up} times without budget, {erases} erases"
        );
        master.restart(true);
    }
}

#[test]
fn the_erases_of_the_pages_are_counted_and_survive_a_power_cut() {
    for personality in Personality::ALL {
        let mut master = Master::new(personality, 2);
        let new = master.board.chip.erases();
        let mut last = 0;
        for _ in 0..300 {
            let place = master.rng.usize(..master.all.len());
            assert!(master.store(place));
            let erases = master.board.read(ERASES);
            assert!(erases == last || erases == last + 1);
            if erases > last && master.rng.bool() {
                master.restart(true);
                assert_eq!(master.board.read(ERASES), erases);
            }
            last = erases;
        }
        assert!(last >= 4, "{last}");
        assert_eq!(master.board.chip.erases() - new, last);
    }
}

/// A wrong program in a PLC: each save fills a page a little, and a reset erases the other page.
#[test]
fn saves_and_resets_in_a_loop_cannot_wear_the_memory_out() {
    for personality in Personality::ALL {
        let mut master = Master::new(personality, 3);
        let new = master.board.chip.erases();
        for _ in 0..1000 {
            let place = master.rng.usize(..master.all.len());
            if !master.store(place) || master.rng.u8(..3) == 0 {
                master.restart(false);
            }
        }
        let erases = master.board.chip.erases() - new;
        assert!(erases <= 20, "{erases} in a loop of seconds");
        assert_eq!(master.board.read(ERASES_ALLOWED), 0);
        assert!(!master.store(0), "refused without effect");
        master.board.wait(Duration::from_millis(10 * 60_000));
        master.board.run(30);
        assert!(master.store(0), "ten minutes later");
    }
}

/// Two requests one after the other, at any distance: both orders of all pairs.
#[test]
fn a_value_written_between_two_requests_is_stored_when_the_second_is_answered() {
    for personality in Personality::ALL {
        for (first, second) in (0..4).flat_map(|first| (0..4).map(move |second| (first, second))) {
            for distance in [0, 1, 2, 3, 4, 6, 9] {
                let mut master = Master::new(personality, 4);
                if first.max(second) >= master.all.len() {
                    continue;
                }
                assert!(master.request(first).is_ok());
                master.board.run(distance);
                let was_answered = master.board.has_response();
                let _ = master.request(second);
                let answer = master.board.wait_for_response().expect("power");
                assert!(answer.is_ok() || !was_answered, "{first} {second} after {distance} ms");
                master.answered(second, answer);
                master.restart(true);
            }
        }
    }
}
