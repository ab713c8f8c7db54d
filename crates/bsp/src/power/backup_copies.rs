//! A few words in the backup SRAM, written every millisecond, although the power may fail at any moment.
//!
//! There are two copies, each with a sequence number and a CRC. A write overwrites the older copy. A loss of power
//! during the write damages that copy only; the other copy is valid, and one write older.

use core::sync::atomic::{AtomicU32, Ordering};

use crate::power::reset_cause::ResetCause;

/// Number of words in a copy.
pub const CAPACITY: usize = 10;

const _: () = assert!(CAPACITY.is_multiple_of(2), "words are written in pairs");

/// The words of a copy.
pub type Content = [u32; CAPACITY];

/// Distinguishes a damaged copy from memory that never held a copy, or a copy of another layout.
const MARK: u32 = 0x4B45_5032;

/// A copy in memory.
#[derive(Debug)]
#[repr(C)]
pub struct Slot {
    mark: AtomicU32,
    sequence: AtomicU32,
    content: [AtomicU32; CAPACITY],
    checksum: AtomicU32,
}

/// Both copies.
pub type Slots = [Slot; 2];

/// Content of the memory at the start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BackupState {
    /// Neither copy exists: nothing was ever written, or the battery was empty.
    Nothing,
    /// The record that was written last.
    Intact(Content),
    /// At least one copy exists, but none is valid.
    Damaged,
}

impl BackupState {
    /// The state that counts after a reset with this cause. Without a battery the memory decays in part within a minute:
    /// the mark may live while the content does not. So after a loss of power, damaged memory is lost memory.
    #[must_use]
    pub fn after(self, cause: ResetCause) -> BackupState {
        match self {
            BackupState::Damaged if cause.is_power_loss() => BackupState::Nothing,
            found => found,
        }
    }
}

/// A 32-bit CRC over words, the sequence number first.
pub trait Checksum {
    /// Starts with this word.
    fn start(&mut self, word: u32);
    /// Adds this word.
    fn add(&mut self, word: u32);
    /// The CRC of all words.
    fn value(&self) -> u32;
}

/// Writes the two copies alternately.
pub struct BackupCopies<'a, C> {
    slots: &'a Slots,
    checksum: C,
    /// The sequence number of the newer copy. Even numbers belong to the first place, odd numbers to the second.
    sequence: u32,
}

impl<'a, C: Checksum> BackupCopies<'a, C> {
    /// Finds the newer of the valid copies. The next write overwrites the other one.
    pub fn open(slots: &'a Slots, mut checksum: C) -> (BackupCopies<'a, C>, BackupState) {
        let [first, second] = slots.each_ref().map(|slot| slot.read(&mut checksum));
        let good = [first.filter(|copy| copy.0 % 2 == 0), second.filter(|copy| copy.0 % 2 == 1)];
        let newer = match good {
            [Some(first), Some(second)] if is_later(first.0, second.0) => Some(first),
            [first, second] => second.or(first),
        };
        let had_one = slots.iter().any(Slot::has_mark);
        let (sequence, found) = match newer {
            Some((sequence, content)) => (sequence, BackupState::Intact(content)),
            None => (0, if had_one { BackupState::Damaged } else { BackupState::Nothing }),
        };
        (BackupCopies { slots, checksum, sequence }, found)
    }

    /// Overwrites the older copy. False if the memory has not taken the words: the next write goes to the same place,
    /// and the newer copy is unchanged.
    pub fn write(&mut self, content: &Content) -> bool {
        let next = self.sequence.wrapping_add(1);
        let [even, odd] = self.slots;
        let slot = if next.is_multiple_of(2) { even } else { odd };
        let is_taken = slot.write(next, content, &mut self.checksum);
        if is_taken {
            self.sequence = next;
        }
        is_taken
    }
}

impl Slot {
    fn has_mark(&self) -> bool {
        self.mark.load(Ordering::Relaxed) == MARK
    }

    /// The sequence number and the content of a valid copy.
    fn read(&self, checksum: &mut impl Checksum) -> Option<(u32, Content)> {
        let sequence = self.sequence.load(Ordering::Relaxed);
        let content = self.content.each_ref().map(|word| word.load(Ordering::Relaxed));
        checksum.start(sequence);
        for word in &content {
            checksum.add(*word);
        }
        let is_good = self.has_mark() && self.checksum.load(Ordering::Relaxed) == checksum.value();
        is_good.then_some((sequence, content))
    }

    /// Writes a copy. The mark comes last, so a first write that is cut short counts as nothing written, not as damage.
    /// Returns whether the first and the last words read back: memory that is locked or has no clock takes none.
    fn write(&self, sequence: u32, content: &Content, checksum: &mut impl Checksum) -> bool {
        self.sequence.store(sequence, Ordering::Relaxed);
        checksum.start(sequence);
        // Two words at a time, because the loop itself takes as long as a word.
        let (to, from) = (self.content.as_chunks().0, content.as_chunks().0);
        for ([first_to, second_to], [first, second]) in to.iter().zip(from) {
            first_to.store(*first, Ordering::Relaxed);
            checksum.add(*first);
            second_to.store(*second, Ordering::Relaxed);
            checksum.add(*second);
        }
        let checksum = checksum.value();
        self.checksum.store(checksum, Ordering::Relaxed);
        self.mark.store(MARK, Ordering::Release);
        let read = (self.sequence.load(Ordering::Relaxed), self.checksum.load(Ordering::Relaxed));
        read == (sequence, checksum) && self.has_mark()
    }
}

/// Whether a sequence number is later than another one. The numbers wrap, so half of all numbers are later.
fn is_later(sequence: u32, than: u32) -> bool {
    sequence.wrapping_sub(than) < 1 << 31
}

#[cfg(test)]
mod tests {
    use crc::{CRC_32_MPEG_2, Crc, Digest};

    use super::*;

    /// Words of a copy.
    const WORDS: usize = CAPACITY + 3;

    static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_MPEG_2);

    /// The CRC as computed by the chip's CRC unit.
    struct Software(Digest<'static, u32>);

    impl Checksum for Software {
        fn start(&mut self, word: u32) {
            self.0 = CRC.digest();
            self.add(word);
        }

        fn add(&mut self, word: u32) {
            self.0.update(&word.to_be_bytes());
        }

        fn value(&self) -> u32 {
            self.0.clone().finalize()
        }
    }

    impl Slot {
        fn filled(word: u32) -> Slot {
            let place = || AtomicU32::new(word);
            Slot {
                mark: place(),
                sequence: place(),
                content: core::array::from_fn(|_| place()),
                checksum: place(),
            }
        }

        /// The words in the order of a write.
        fn words(&self) -> impl Iterator<Item = &AtomicU32> {
            let inner = [&self.sequence].into_iter().chain(&self.content);
            inner.chain([&self.checksum, &self.mark])
        }
    }

    fn memory(word: u32) -> Slots {
        core::array::from_fn(|_| Slot::filled(word))
    }

    fn open(slots: &Slots) -> (BackupCopies<'_, Software>, BackupState) {
        BackupCopies::open(slots, Software(CRC.digest()))
    }

    fn found(slots: &Slots) -> BackupState {
        open(slots).1
    }

    /// The content that write number `number` writes in these tests.
    fn content(number: u32) -> Content {
        core::array::from_fn(|n| number.wrapping_mul(0x9E37_79B9).rotate_left(u32::try_from(n).unwrap()))
    }

    fn written(writes: u32) -> Slots {
        let slots = memory(0xA5A5_A5A5);
        let mut copies = open(&slots).0;
        (1..=writes).for_each(|number| assert!(copies.write(&content(number))));
        slots
    }

    #[test]
    fn damage_after_a_loss_of_power_is_a_loss() {
        use ResetCause::{BrownOut, IndependentWatchdog, Pin, PowerOn, Software, Unknown};
        let intact = BackupState::Intact(content(1));
        for cause in [PowerOn, BrownOut] {
            assert_eq!(BackupState::Damaged.after(cause), BackupState::Nothing);
            assert_eq!(intact.after(cause), intact);
        }
        for cause in [IndependentWatchdog, Software, Pin, Unknown] {
            assert_eq!(BackupState::Damaged.after(cause), BackupState::Damaged);
        }
    }

    #[test]
    fn memory_that_was_never_written_has_nothing() {
        for word in [0, u32::MAX, 0xA5A5_A5A5] {
            assert_eq!(found(&memory(word)), BackupState::Nothing);
        }
    }

    #[test]
    fn the_latest_copy_is_found_and_continued() {
        for writes in 1..=5 {
            let slots = written(writes);
            let (mut copies, found) = open(&slots);
            assert_eq!(found, BackupState::Intact(content(writes)));
            copies.write(&content(100));
            assert_eq!(open(&slots).1, BackupState::Intact(content(100)));
        }
    }

    #[test]
    fn the_sequence_may_wrap() {
        let slots = memory(0);
        let mut copies =
            BackupCopies { slots: &slots, checksum: Software(CRC.digest()), sequence: u32::MAX - 3 };
        for number in 0..8 {
            copies.write(&content(number));
            assert_eq!(found(&slots), BackupState::Intact(content(number)));
        }
    }

    /// The power fails after any number of the words of a write, in the order of the write.
    #[test]
    fn a_write_that_is_cut_short_leaves_the_one_before() {
        for writes in 0..4 {
            let next = written(writes + 1);
            for done in 0..WORDS {
                let slots = written(writes);
                let target = (writes as usize + 1) % 2;
                for (to, from) in slots[target].words().zip(next[target].words()).take(done) {
                    to.store(from.load(Ordering::Relaxed), Ordering::Relaxed);
                }
                let expected =
                    if writes == 0 { BackupState::Nothing } else { BackupState::Intact(content(writes)) };
                // From the second round on the mark is already there, so the write is complete without it.
                let is_whole = writes >= 2 && done == WORDS - 1;
                let expected = if is_whole { BackupState::Intact(content(writes + 1)) } else { expected };
                assert_eq!(found(&slots), expected, "{writes} writes and {done} words");
            }
        }
    }

    #[test]
    fn any_flipped_bit_of_both_copies_is_damage() {
        // All words but the mark, without which there is no copy.
        for bit in 0..(WORDS - 1) * 32 {
            let slots = written(2);
            for slot in &slots {
                slot.words().nth(bit / 32).unwrap().fetch_xor(1 << (bit % 32), Ordering::Relaxed);
            }
            assert_eq!(found(&slots), BackupState::Damaged, "bit {bit}");
        }
    }
}
