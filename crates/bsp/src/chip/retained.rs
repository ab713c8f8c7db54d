//! RAM that survives a reset, at the same address in both images (memory.x, RETAINED), and never initialised.
#![expect(unsafe_code, reason = "a place in memory that the linker knows")]

use core::sync::atomic::{AtomicU32, Ordering};

use update::{Clears, Crashes, Pair, Proof};

use crate::chip::crash_record::{self, WORDS};
use crate::chip::handover::{self, Handover};

/// The content. Both images must agree on the layout, so the layout can change only with a new bootloader.
#[repr(C)]
struct Retained {
    handover: [AtomicU32; 2],
    crashes: AtomicU32,
    crash: [AtomicU32; WORDS],
    proven: [AtomicU32; 2],
    bootloader: AtomicU32,
    /// A mark that says whether the rest is valid, then challenge and response.
    authorisation: [AtomicU32; 5],
    /// The erase budget of the parameter memory, and its complement.
    erase_budget: [AtomicU32; 2],
    /// Tries of the clock, and their complement.
    clock_tries: AtomicU32,
    /// Clears of staging that the budget has to make up for.
    clears: AtomicU32,
}

/// `used` keeps the compiler from assuming the initial values, which a reset does not write.
#[used]
#[unsafe(link_section = ".retained")]
static RETAINED: Retained = Retained {
    handover: [const { AtomicU32::new(0) }; 2],
    crashes: AtomicU32::new(0),
    crash: [const { AtomicU32::new(0) }; WORDS],
    proven: [const { AtomicU32::new(0) }; 2],
    bootloader: AtomicU32::new(0),
    authorisation: [const { AtomicU32::new(0) }; 5],
    erase_budget: [const { AtomicU32::new(0) }; 2],
    clock_tries: AtomicU32::new(0),
    clears: AtomicU32::new(0),
};

/// The mark of a development bootloader: 'DEVL'.
const DEVELOPMENT: u32 = u32::from_be_bytes(*b"DEVL");
/// The mark of a bootloader with an authorisation key for program changes: 'GARD'.
const GUARDED: u32 = u32::from_be_bytes(*b"GARD");

/// The note of the other image; `None` if none was left since power-on.
#[must_use]
pub fn handover() -> Option<Handover> {
    Handover::open(&load(&RETAINED.handover))
}

/// Leaves a note for the other image.
#[inline(never)]
pub fn hand_over(note: &Handover) {
    let words: handover::Sealed = note.seal();
    store(&RETAINED.handover, words);
}

/// Number of crashes of the application since it last confirmed itself.
#[must_use]
pub fn crashes() -> Crashes {
    Crashes::from_word(RETAINED.crashes.load(Ordering::Relaxed))
}

/// Stores the count of crashes.
pub fn set_crashes(crashes: Crashes) {
    RETAINED.crashes.store(crashes.word(), Ordering::Relaxed);
}

/// The budget of clears, as it was left.
#[must_use]
pub fn clears() -> Clears {
    Clears::from_word(RETAINED.clears.load(Ordering::Relaxed))
}

/// Keeps the budget of clears.
pub fn set_clears(clears: Clears) {
    RETAINED.clears.store(clears.word(), Ordering::Relaxed);
}

/// The image whose signature was verified since power-on, identified by the CRC of its header.
#[must_use]
pub fn proof() -> Proof {
    let [crc, complement] = load(&RETAINED.proven);
    if complement == !crc { Proof::Of(crc) } else { Proof::None }
}

/// Stores the word of [`update::boot_sealed`].
pub fn set_proof(seal: u32) {
    store(&RETAINED.proven, [seal, !seal]);
}

/// The present word, whatever its value.
pub(crate) fn seal() -> u32 {
    let [seal, _] = load(&RETAINED.proven);
    seal
}

/// Forgets the verified image, at power-on.
pub fn forget_proof() {
    store(&RETAINED.proven, [0, 0]);
}

/// Leaves a note whether this is a development bootloader.
pub fn set_development(is_for_development: bool) {
    RETAINED.bootloader.store(if is_for_development { DEVELOPMENT } else { 0 }, Ordering::Relaxed);
}

/// Whether the application was started by a development bootloader, which also starts unsigned images.
#[must_use]
pub fn is_development() -> bool {
    RETAINED.bootloader.load(Ordering::Relaxed) == DEVELOPMENT
}

/// Challenge and response of this start, if the bootloader has an authorisation key.
#[must_use]
pub fn authorisation() -> Option<Pair> {
    let [mark, a, b, c, d] = load(&RETAINED.authorisation);
    (mark == GUARDED).then(|| Pair::from_words([a, b, c, d]))
}

/// Leaves challenge and response for the application.
pub fn set_authorisation(pair: &Pair) {
    let [a, b, c, d] = pair.words();
    store(&RETAINED.authorisation, [GUARDED, a, b, c, d]);
}

/// Removes challenge and response: anybody may change the program.
pub fn forget_authorisation() {
    let [mark, ..] = &RETAINED.authorisation;
    mark.store(0, Ordering::Relaxed);
}

/// The rest of the erase budget of the run before; `None` after a loss of power.
#[must_use]
pub fn erase_budget() -> Option<u16> {
    let [budget, complement] = load(&RETAINED.erase_budget);
    if complement == !budget { u16::try_from(budget).ok() } else { None }
}

/// Keeps the erase budget for the next start.
pub fn set_erase_budget(budget: u16) {
    store(&RETAINED.erase_budget, [budget.into(), !u32::from(budget)]);
}

/// The place of the number of tries in the lower half, with its complement in the upper one.
pub(crate) const CLOCK_TRIES: *const u32 = (&raw const RETAINED.clock_tries).cast::<u32>();

/// Number of resets since power-on because there was no clock on OSC_IN.
#[must_use]
pub fn clock_tries() -> u16 {
    let word = RETAINED.clock_tries.load(Ordering::Relaxed);
    let [tries, complement] = [word as u16, (word >> 16) as u16];
    if complement == !tries { tries } else { 0 }
}

/// Keeps the number for the next start.
pub fn set_clock_tries(tries: u16) {
    RETAINED.clock_tries.store(u32::from(!tries) << 16 | u32::from(tries), Ordering::Relaxed);
}

/// The words of the crash record.
pub(crate) fn crash() -> crash_record::Sealed {
    load(&RETAINED.crash)
}

/// Replaces the words of the crash record.
pub(crate) fn set_crash(words: crash_record::Sealed) {
    store(&RETAINED.crash, words);
}

fn load<const N: usize>(words: &[AtomicU32; N]) -> [u32; N] {
    core::array::from_fn(|at| words.get(at).map_or(0, |word| word.load(Ordering::Relaxed)))
}

fn store<const N: usize>(words: &[AtomicU32; N], values: [u32; N]) {
    for (word, value) in words.iter().zip(values) {
        word.store(value, Ordering::Relaxed);
    }
}
