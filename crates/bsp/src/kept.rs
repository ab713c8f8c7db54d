//! A few bytes in memory that a battery keeps, written again and again, while the power may go at any moment.
//!
//! There are two copies, each with a sequence number and a CRC, and the older one is overwritten. So a write that is cut
//! short damages what was of no more use, and the other copy is one write old.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::checksum::CRC;

/// Bytes that a copy holds.
pub const CAPACITY: usize = 72;

const CONTENT: usize = CAPACITY / 4;
/// Mark, sequence number, content, CRC.
const WORDS: usize = 3 + CONTENT;
/// Tells a damaged copy from memory that never held one.
const MARK: u32 = 0x4B45_5054;

/// The place of a copy in memory.
pub type Slot = [AtomicU32; WORDS];

/// The places of both.
pub type Slots = [Slot; 2];

/// What the memory had.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// No trace of a copy: nothing was ever written, or the battery was empty.
    Nothing,
    /// What was written last, filled up with zeros.
    Kept([u8; CAPACITY]),
    /// A copy was there, and none is good.
    Damaged,
}

/// Writes the copies in turn.
pub struct Keeper<'a> {
    copies: &'a Slots,
    /// Of the latest copy; its lowest bit tells which one that is.
    sequence: u32,
}

impl<'a> Keeper<'a> {
    /// Finds the newer good copy. The next write goes over the other one.
    pub fn open(copies: &'a Slots) -> (Keeper<'a>, Found) {
        let good = [0, 1].map(|n| read(&copies[n]).filter(|sealed| sealed[1] as usize % 2 == n));
        let newer = match good {
            [Some(first), Some(second)] if is_later(first[1], second[1]) => Some(first),
            [first, second] => second.or(first),
        };
        let had_one = copies.iter().any(|copy| copy[0].load(Ordering::Relaxed) == MARK);
        let found = match newer {
            Some(sealed) => Found::Kept(content(&sealed)),
            None if had_one => Found::Damaged,
            None => Found::Nothing,
        };
        (Keeper { copies, sequence: newer.map_or(0, |sealed| sealed[1]) }, found)
    }

    /// Keeps `bytes`; those beyond [`CAPACITY`] are left out.
    pub fn write(&mut self, bytes: &[u8]) {
        self.sequence = self.sequence.wrapping_add(1);
        let copy = &self.copies[self.sequence as usize % 2];
        let sealed = seal(self.sequence, bytes);
        // The mark comes last: where a first write is cut short there was nothing, and not something that is damaged.
        for (to, from) in copy.iter().zip(sealed).rev() {
            to.store(from, Ordering::Relaxed);
        }
    }
}

/// Counted round: half of all numbers are later.
fn is_later(sequence: u32, than: u32) -> bool {
    sequence.wrapping_sub(than) < 1 << 31
}

fn seal(sequence: u32, bytes: &[u8]) -> [u32; WORDS] {
    let mut sealed = [0; WORDS];
    sealed[0] = MARK;
    sealed[1] = sequence;
    for (word, bytes) in sealed[2..WORDS - 1].iter_mut().zip(bytes.chunks(4)) {
        let mut padded = [0; 4];
        padded[..bytes.len()].copy_from_slice(bytes);
        *word = u32::from_le_bytes(padded);
    }
    sealed[WORDS - 1] = checksum(&sealed);
    sealed
}

/// A copy that is good.
fn read(copy: &Slot) -> Option<[u32; WORDS]> {
    let sealed = copy.each_ref().map(|word| word.load(Ordering::Relaxed));
    (sealed[0] == MARK && sealed[WORDS - 1] == checksum(&sealed)).then_some(sealed)
}

fn content(sealed: &[u32; WORDS]) -> [u8; CAPACITY] {
    let mut content = [0; CAPACITY];
    let (chunks, _) = content.as_chunks_mut();
    chunks.iter_mut().zip(&sealed[2..]).for_each(|(to, from)| *to = from.to_le_bytes());
    content
}

/// CRC-32 of all words but the last.
fn checksum(sealed: &[u32; WORDS]) -> u32 {
    let mut digest = CRC.digest();
    sealed[..WORDS - 1].iter().for_each(|word| digest.update(&word.to_le_bytes()));
    digest.finalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory(word: u32) -> Slots {
        core::array::from_fn(|_| core::array::from_fn(|_| AtomicU32::new(word)))
    }

    fn found(copies: &Slots) -> Found {
        Keeper::open(copies).1
    }

    /// What `write` with this number keeps.
    fn bytes(number: u8) -> [u8; CAPACITY] {
        core::array::from_fn(|n| number.wrapping_mul(31).wrapping_add(n as u8))
    }

    fn written(writes: u8) -> Slots {
        let copies = memory(0xA5A5_A5A5);
        let mut keeper = Keeper::open(&copies).0;
        (1..=writes).for_each(|number| keeper.write(&bytes(number)));
        copies
    }

    #[test]
    fn memory_that_was_never_written_has_nothing() {
        for word in [0, u32::MAX, 0xA5A5_A5A5] {
            assert_eq!(found(&memory(word)), Found::Nothing);
        }
    }

    #[test]
    fn the_latest_is_found_and_goes_on() {
        for writes in 1..=5 {
            let copies = written(writes);
            let (mut keeper, found) = Keeper::open(&copies);
            assert_eq!(found, Found::Kept(bytes(writes)));
            keeper.write(&bytes(100));
            assert_eq!(Keeper::open(&copies).1, Found::Kept(bytes(100)));
        }
    }

    #[test]
    fn the_sequence_may_wrap() {
        let copies = memory(0);
        let mut keeper = Keeper { copies: &copies, sequence: u32::MAX - 3 };
        for number in 0..8 {
            keeper.write(&bytes(number));
            assert_eq!(found(&copies), Found::Kept(bytes(number)));
        }
    }

    #[test]
    fn fewer_bytes_are_filled_up_and_more_are_cut() {
        let copies = memory(0);
        let mut keeper = Keeper::open(&copies).0;
        keeper.write(&[1, 2, 3, 4, 5]);
        let mut expected = [0; CAPACITY];
        expected[..5].copy_from_slice(&[1, 2, 3, 4, 5]);
        assert_eq!(found(&copies), Found::Kept(expected));
        keeper.write(&[7; CAPACITY + 1]);
        assert_eq!(found(&copies), Found::Kept([7; CAPACITY]));
    }

    /// The power goes after any number of the words of a write, in the order in which they are written.
    #[test]
    fn a_write_that_is_cut_short_leaves_the_one_before() {
        for writes in 0..4_u8 {
            for done in 0..WORDS {
                let copies = written(writes);
                let sealed = seal(u32::from(writes) + 1, &bytes(writes + 1));
                let target = &copies[(usize::from(writes) + 1) % 2];
                for (to, from) in target.iter().zip(sealed).rev().take(done) {
                    to.store(from, Ordering::Relaxed);
                }
                let expected = if writes == 0 { Found::Nothing } else { Found::Kept(bytes(writes)) };
                // From the second round on the mark is there already: without it the write is complete.
                let is_whole = writes >= 2 && done == WORDS - 1;
                let expected = if is_whole { Found::Kept(bytes(writes + 1)) } else { expected };
                assert_eq!(found(&copies), expected, "{writes} writes and {done} words");
            }
        }
    }

    #[test]
    fn any_flipped_bit_of_both_copies_is_damage() {
        for bit in 32..WORDS * 32 {
            let copies = written(2);
            for copy in &copies {
                copy[bit / 32].fetch_xor(1 << (bit % 32), Ordering::Relaxed);
            }
            assert_eq!(found(&copies), Found::Damaged, "bit {bit}");
        }
    }
}
