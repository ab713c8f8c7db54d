//! The observations of the program since its start, for the values of the board (2005h).

use core::sync::atomic::AtomicU32;
#[cfg(feature = "development")]
use core::sync::atomic::Ordering;

/// Observations of the program since its start. Written by one task each.
pub(crate) static SEEN: Seen = Seen {
    reset_flags: AtomicU32::new(0),
    peaks: AtomicU32::new(0),
    errors: [const { AtomicU32::new(0) }; ERRORS],
    longest_erase: AtomicU32::new(0),
};

/// Kinds of errors in LEC: stuff, form, acknowledge, recessive bit, dominant bit, CRC (RM0390, 30.9.2).
const ERRORS: usize = 6;

/// The words, in the order of their numbers.
#[repr(C)]
pub(crate) struct Seen {
    /// RCC_CSR at the start.
    pub(crate) reset_flags: AtomicU32,
    /// The highest transmit error counter in the lower half, and the highest receive error counter in the upper half.
    pub(crate) peaks: AtomicU32,
    /// How often the last error code was each of the errors; looked at every 20 ms.
    pub(crate) errors: [AtomicU32; ERRORS],
    /// The longest erase of a parameter page in microseconds.
    longest_erase: AtomicU32,
}

/// Takes note of the time of an erase.
#[cfg(feature = "development")]
pub(crate) fn note_erase(microseconds: u64) {
    let longest = SEEN.longest_erase.load(Ordering::Relaxed).max(microseconds as u32);
    SEEN.longest_erase.store(longest, Ordering::Relaxed);
}
