//! Power cuts with the real bootloader. Crate `update` tests the same with every outcome of a torn word; this test runs
//! the bootloader with its flash driver, on a flash that the emulator tears.
//!
//! B is a program of five words, so that its complete update can be cut at every operation. A is the real application;
//! only some operations of the copy that keeps A are cut.

use std::ops::Range;

use canbus::Time;
use host_tests::thorough::{either, is_thorough};
use programmer::sign::image::Image;

use super::bench::{Bench, CLEAR, STATUS, signed, version_a, version_b};
use crate::support::SECOND;

/// The address at which B stores its mark: in RAM that the bootloader does not use. The mark is this address.
const MARK: u32 = 0x2001_0000;
/// An operation that is never reached.
const NO_CUT: u64 = u64::MAX >> 1;
/// Operations of the copy of B: a sector erase, the words of the program, the mark of completion.
const COPY: u64 = 1 + 133 + 1;
/// Two of this many cuts in the copy are followed by a second cut.
const SECOND_CUTS: u64 = 7;
/// The longest recovery: two erases, and a start; in steps of 20 ms.
const PATIENCE: u32 = 300;

/// Stack pointer, reset vector, `ldr r0, [pc, #4]`, `str r0, [r0]`, `b .`, and the address of the mark (the code starts
/// at 0802 0200h).
fn small() -> Image {
    let words: [u32; 5] = [0x2000_4000, 0x0802_0209, 0x6000_4801, 0xBF00_E7FE, MARK];
    signed(words.iter().flat_map(|word| word.to_le_bytes()).collect(), |_| ())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Runs {
    A,
    B,
}

/// A node that loses its power during an update, and the original content of its flash.
struct Victim {
    bench: Bench,
    flash: Vec<u8>,
    a: Vec<u8>,
    b: Vec<u8>,
    image: Vec<u8>,
}

impl Victim {
    fn new() -> Victim {
        let mut bench = Bench::running();
        let a = bench.application();
        let image = small().to_bytes();
        let mut b = vec![0xFF; a.len()];
        b[..image.len()].copy_from_slice(&image);
        let flash = bench.machine().flash();
        Victim { bench, flash, a, b, image }
    }

    /// Restores A and the original flash.
    fn restore(&mut self) {
        self.bench.machine().set_flash(&self.flash).unwrap();
        self.bench.power_cycle();
        assert_eq!(self.wait(), Some(Runs::A));
    }

    /// The complete update sequence of a master that ignores the power cut at flash operation `cut`. Returns the number
    /// of operations.
    fn update(&mut self, cut: u64) -> u64 {
        let bench = &mut self.bench;
        bench.stop();
        let flash = bench.machine().peripherals_mut().flash_mut();
        let before = flash.operations();
        flash.cut_power_at_operation(cut);
        go_on_without_the_node(bench, &self.image);
        bench.machine().peripherals_mut().flash_mut().operations() - before
    }

    /// Switches the power on, with another cut in the recovery. Returns whether the recovery reached that operation.
    fn cut_again(&mut self, second: u64) -> bool {
        self.bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(second);
        self.bench.power_cycle();
        self.bench.run(SECOND * 2);
        self.bench.machine().next_event() == Time::NEVER
    }

    /// Switches the power on without a further cut, and waits for the program that runs in the end.
    fn recover(&mut self) -> Option<Runs> {
        self.bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(NO_CUT);
        self.bench.power_cycle();
        self.wait()
    }

    /// The running program: A, which answers, or B, which leaves its mark; `None` if the program is not complete.
    fn wait(&mut self) -> Option<Runs> {
        for _ in 0..PATIENCE {
            self.bench.run(Time::from_millis(20));
            let mut mark = [0; 4];
            self.bench.machine().read(MARK, &mut mark).unwrap();
            if u32::from_le_bytes(mark) == MARK {
                return (self.bench.application() == self.b).then_some(Runs::B);
            }
            if self.bench.is_running() {
                return (self.bench.application() == self.a).then_some(Runs::A);
            }
        }
        None
    }
}

/// Clear, download, and time for the copy.
fn go_on_without_the_node(bench: &mut Bench, image: &[u8]) {
    let _ = bench.command(CLEAR);
    let _ = (0..3000).find(|_| {
        bench.run(Time::from_millis(1));
        !matches!(bench.read(STATUS).as_deref(), Ok([1, ..]))
    });
    let _ = bench.download(image);
    let _ = (0..3000).find(|_| {
        bench.run(Time::from_millis(1));
        !matches!(bench.read(STATUS).as_deref(), Ok([1, ..]))
    });
}

/// Without `--thorough`, one of this many operations is cut.
const SAMPLE: u64 = 20;

/// One of this many operations that keep A is cut, except for those at the begin and the end.
const KEEPING_SAMPLE: u64 = 2001;
const ENDS: u64 = 6;

/// The operations that keep A, except for those at the begin and the end, in an update of `all` operations.
fn keeping(all: u64) -> Range<u64> {
    let copy = all - COPY;
    let keeping = 4 + 1 + version_a().to_bytes().len() as u64 / 4 + 3;
    copy - keeping + ENDS..copy - ENDS
}

/// Whether the power is cut in this operation. The operations behind `keeping` are counted from its end, so that the sample
/// does not depend on the size of A.
fn is_cut(cut: u64, keeping: &Range<u64>) -> bool {
    if keeping.contains(&cut) {
        ((cut - keeping.start) / 2).is_multiple_of(either(KEEPING_SAMPLE, KEEPING_SAMPLE / 10))
    } else {
        let number = cut.checked_sub(keeping.end).unwrap_or(cut);
        is_thorough() || (number / 2).is_multiple_of(SAMPLE)
    }
}

/// Whether a second cut follows: in two of [`SECOND_CUTS`] cuts of the copy, among them two of the sample.
fn has_second(cut: u64, all: u64, keeping: &Range<u64>) -> bool {
    cut > all - COPY && (cut - keeping.end) / 2 % SECOND_CUTS >= SECOND_CUTS - 2
}

/// Cuts at every operation whose number has this remainder modulo two, so that two processes share the work; at a twentieth
/// of the operations without `--thorough`.
fn cut_everywhere(rest: u64) {
    let mut victim = Victim::new();
    let all = victim.update(NO_CUT);
    assert_eq!(victim.recover(), Some(Runs::B), "without a cut");
    let keeping = keeping(all);
    let (mut runs, mut kept, mut twice) = ([0; 2], 0, 0);
    victim.restore();
    for cut in (1..=all).filter(|cut| cut % 2 == rest && is_cut(*cut, &keeping)) {
        victim.update(cut);
        let second = 1 + cut * 37 % COPY;
        if has_second(cut, all, &keeping) {
            twice += usize::from(victim.cut_again(second));
        }
        let Some(found) = victim.recover() else { panic!("cut {cut} of {all}, perhaps then {second}") };
        if keeping.contains(&cut) {
            assert_eq!(found, Runs::B, "it was committed: cut {cut} of {all}");
            kept += 1;
        } else {
            runs[found as usize] += 1;
        }
        if found == Runs::B {
            victim.restore();
        }
    }
    println!(
        "{} cuts in an update of {all} operations, {twice} of them with a second one: {} times A, {} times B; \
         and {kept} where A is kept, B each time",
        runs[0] + runs[1],
        runs[0],
        runs[1]
    );
    let cuts = runs[0] + runs[1];
    let is_even = runs.iter().all(|&each| each > cuts * 3 / 8);
    assert!(is_even && twice > cuts / 16, "{runs:?}, {twice}");
}

#[test]
fn the_power_goes_at_every_even_operation_of_an_update() {
    cut_everywhere(0);
}

#[test]
fn the_power_goes_at_every_odd_operation_of_an_update() {
    cut_everywhere(1);
}

/// Both programs are real applications here, so each of them answers.
#[test]
fn after_any_power_cut_the_node_starts_one_of_the_two_programs() {
    let cuts = either(4, 8);
    let (a, b) = (version_a(), version_b(0));
    let words = (b.to_bytes().len() / 4) as u64;
    // Operations: clear, download, keeping A, the copy with its erases, and the records in between.
    let all = 6 + words + 4 + 8 + words + 2 + words;
    let (mut old, mut new) = (0, 0);
    for cut in 0..cuts {
        let mut bench = Bench::running();
        bench.stop();
        bench.machine().peripherals_mut().flash_mut().cut_power_at_operation(1 + cut * all / cuts + cut);
        go_on_without_the_node(&mut bench, &b.to_bytes());
        bench.power_cycle();
        bench.run(SECOND * 6);
        let found = bench.identification_of_running();
        assert!([a.header.code_crc(), b.header.code_crc()].contains(&found), "cut {cut}");
        if found == a.header.code_crc() { old += 1 } else { new += 1 }
    }
    println!("{cuts} cuts: {old} times the old application, {new} times the new one");
    assert!(old > 0 && new > 0);
}
