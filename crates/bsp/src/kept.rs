//! A few bytes in memory that a battery keeps, written again and again, while the power may go at any moment.
//!
//! There are two copies, each with a sequence number and a CRC, and the older one is overwritten. So a write that is cut
//! short damages what was of no more use, and the other copy is one write old.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::checksum::CRC;

/// Bytes that a copy holds.
pub const CAPACITY: usize = 72;

/// Mark, sequence number, content, CRC, of which all but the content are a word each.
const SIZE: usize = 12 + CAPACITY;
const WORDS: usize = SIZE / 4;
/// Tells a damaged copy from memory that never held one.
const MARK: u32 = 0x4B45_5054;

/// A copy.
type Sealed = [u8; SIZE];

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
    slots: &'a Slots,
    /// Of the latest copy; its lowest bit tells which one that is.
    sequence: u32,
}

impl<'a> Keeper<'a> {
    /// Finds the newer good copy. The next write goes over the other one.
    pub fn open(slots: &'a Slots) -> (Keeper<'a>, Found) {
        let good = [0, 1].map(|n| read(&slots[n]).filter(|sealed| sequence(sealed) as usize % 2 == n));
        let newer = match good {
            [Some(first), Some(second)] if is_later(sequence(&first), sequence(&second)) => Some(first),
            [first, second] => second.or(first),
        };
        let had_one = slots.iter().any(|slot| slot[0].load(Ordering::Relaxed) == MARK);
        let found = match newer {
            Some(sealed) => Found::Kept(content(&sealed)),
            None if had_one => Found::Damaged,
            None => Found::Nothing,
        };
        (Keeper { slots, sequence: newer.map_or(0, |sealed| sequence(&sealed)) }, found)
    }

    /// Keeps `bytes`; those beyond [`CAPACITY`] are left out.
    pub fn write(&mut self, bytes: &[u8]) {
        self.sequence = self.sequence.wrapping_add(1);
        let slot = &self.slots[self.sequence as usize % 2];
        // The mark comes last: where a first write is cut short there was nothing, and not something that is damaged.
        for (to, from) in slot.iter().zip(seal(self.sequence, bytes).as_chunks().0).rev() {
            to.store(u32::from_le_bytes(*from), Ordering::Relaxed);
        }
    }
}

/// Counted round: half of all numbers are later.
fn is_later(sequence: u32, than: u32) -> bool {
    sequence.wrapping_sub(than) < 1 << 31
}

fn seal(sequence: u32, bytes: &[u8]) -> Sealed {
    let mut sealed = [0; SIZE];
    let length = bytes.len().min(CAPACITY);
    sealed[..4].copy_from_slice(&MARK.to_le_bytes());
    sealed[4..8].copy_from_slice(&sequence.to_le_bytes());
    sealed[8..8 + length].copy_from_slice(&bytes[..length]);
    let sum = checksum(&sealed);
    sealed[SIZE - 4..].copy_from_slice(&sum);
    sealed
}

/// A copy that is good.
fn read(slot: &Slot) -> Option<Sealed> {
    let mut sealed = [0; SIZE];
    let words = slot.iter().map(|word| word.load(Ordering::Relaxed).to_le_bytes());
    sealed.as_chunks_mut().0.iter_mut().zip(words).for_each(|(to, from)| *to = from);
    (sealed[..4] == MARK.to_le_bytes() && sealed[SIZE - 4..] == checksum(&sealed)).then_some(sealed)
}

fn sequence(sealed: &Sealed) -> u32 {
    let [_, _, _, _, a, b, c, d, ..] = *sealed;
    u32::from_le_bytes([a, b, c, d])
}

fn content(sealed: &Sealed) -> [u8; CAPACITY] {
    let mut content = [0; CAPACITY];
    content.copy_from_slice(&sealed[8..8 + CAPACITY]);
    content
}

/// CRC-32 of everything before it.
fn checksum(sealed: &Sealed) -> [u8; 4] {
    CRC.checksum(&sealed[..SIZE - 4]).to_le_bytes()
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
        core::array::from_fn(|n| number.wrapping_mul(31).wrapping_add(n.to_le_bytes()[0]))
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
        let mut keeper = Keeper { slots: &copies, sequence: u32::MAX - 3 };
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
                for (to, from) in target.iter().zip(sealed.as_chunks().0).rev().take(done) {
                    to.store(u32::from_le_bytes(*from), Ordering::Relaxed);
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
