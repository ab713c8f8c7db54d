//! RAM that survives a reset, at one address in both images (memory.x, RETAINED), and never initialised.

use core::sync::atomic::{AtomicU32, Ordering};

use update::{Crashes, Pair, Proof};

use crate::crash_record::{self, WORDS};
use crate::handover::{self, Handover};

/// The content. Both images must agree on the layout, so the layout changes with a new bootloader only.
#[repr(C)]
struct Retained {
    handover: [AtomicU32; 2],
    crashes: AtomicU32,
    crash: [AtomicU32; WORDS],
    proven: [AtomicU32; 2],
    bootloader: AtomicU32,
    /// A word that says that they are there, challenge and response.
    authorisation: [AtomicU32; 5],
}

/// `used` keeps the compiler from taking the initial values for granted: a reset does not write them.
#[used]
#[unsafe(link_section = ".retained")]
static RETAINED: Retained = Retained {
    handover: [const { AtomicU32::new(0) }; 2],
    crashes: AtomicU32::new(0),
    crash: [const { AtomicU32::new(0) }; WORDS],
    proven: [const { AtomicU32::new(0) }; 2],
    bootloader: AtomicU32::new(0),
    authorisation: [const { AtomicU32::new(0) }; 5],
};

/// The word by which a bootloader for development says that it is one: 'DEVL'.
const DEVELOPMENT: u32 = u32::from_be_bytes(*b"DEVL");
/// The word by which a bootloader says that it has a key for those who change the program: 'GARD'.
const GUARDED: u32 = u32::from_be_bytes(*b"GARD");

/// The note of the other image; `None` when there is none since power-on.
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

/// How often the application has crashed since it last confirmed itself.
#[must_use]
pub fn crashes() -> Crashes {
    Crashes::from_word(RETAINED.crashes.load(Ordering::Relaxed))
}

/// Stores the count of crashes.
pub fn set_crashes(crashes: Crashes) {
    RETAINED.crashes.store(crashes.word(), Ordering::Relaxed);
}

/// The image whose signature was found good since power-on, by the CRC of its header.
#[must_use]
pub fn proof() -> Proof {
    let [crc, complement] = load(&RETAINED.proven);
    if complement == !crc { Proof::Of(crc) } else { Proof::None }
}

/// Keeps the word of [`update::boot_sealed`].
pub fn set_proof(seal: u32) {
    store(&RETAINED.proven, [seal, !seal]);
}

/// The word as it is now, whatever it is.
pub(super) fn seal() -> u32 {
    let [seal, _] = load(&RETAINED.proven);
    seal
}

/// Power came: nothing is proven.
pub fn forget_proof() {
    store(&RETAINED.proven, [0, 0]);
}

/// Leaves word whether this bootloader is one for development.
pub fn set_development(is_for_development: bool) {
    RETAINED.bootloader.store(if is_for_development { DEVELOPMENT } else { 0 }, Ordering::Relaxed);
}

/// Whether the bootloader that has started the application is one for development, which starts what nobody has signed.
#[must_use]
pub fn is_development() -> bool {
    RETAINED.bootloader.load(Ordering::Relaxed) == DEVELOPMENT
}

/// Challenge and response of this start, where the bootloader has a key for them.
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

/// Everybody may change the program.
pub fn forget_authorisation() {
    let [mark, ..] = &RETAINED.authorisation;
    mark.store(0, Ordering::Relaxed);
}

/// The words of the crash record.
pub(super) fn crash() -> crash_record::Sealed {
    load(&RETAINED.crash)
}

/// Replaces the words of the crash record.
pub(super) fn set_crash(words: crash_record::Sealed) {
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
