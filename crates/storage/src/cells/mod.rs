//! The cells of a NOR flash, word by word, for the mock flashes of tests. The cells panic when a rule of the real flash
//! is broken, count operations, and lose power in the middle of a chosen operation.
//!
//! The model of a power cut is pessimistic. The bits that were being changed are *weak*: they may read as either value,
//! and as another value after the next power-up, until the word is erased or programmed with zeros. The model therefore
//! remembers a cut word even if the cut left no visible trace: programming the word with anything but zeros breaks a
//! rule.

mod word;

use std::ops::Range;
use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{NorFlashError, NorFlashErrorKind};
use fastrand::Rng;

pub use word::Weak;
use word::Word;

/// Bytes of a word of the STM32F4.
pub const WORD: usize = 4;

/// The power is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// All words of a flash, and its power.
#[derive(Clone, Debug)]
pub struct Cells {
    /// Bytes of a word, 4 or 8.
    word: usize,
    words: Vec<Word>,
    operations: u32,
    programmed: u32,
    cut_at: Option<u32>,
    powered: bool,
    weak: Weak,
    random: Rng,
}

impl Cells {
    /// An erased flash of `size` bytes in words of four. `seed` decides the values of weak bits that read at random.
    #[must_use]
    pub fn new(size: usize, seed: u64) -> Cells {
        Cells::with_words(size, WORD, seed)
    }

    /// An erased flash of `size` bytes in words of `word` bytes, 4 or 8. A word is the unit of programming.
    ///
    /// # Panics
    /// When `word` is neither 4 nor 8.
    #[must_use]
    pub fn with_words(size: usize, word: usize, seed: u64) -> Cells {
        assert!(word == 4 || word == 8, "words of {word} bytes");
        Cells {
            word,
            words: vec![Word::erased(word); size / word],
            operations: 0,
            programmed: 0,
            cut_at: None,
            powered: true,
            weak: Weak::Random,
            random: Rng::with_seed(seed),
        }
    }

    /// Size in bytes.
    #[must_use]
    pub fn size(&self) -> usize {
        self.words.len() * self.word
    }

    /// Operations so far: programmed words and erases.
    #[must_use]
    pub fn operations(&self) -> u32 {
        self.operations
    }

    /// Words programmed so far.
    #[must_use]
    pub fn programmed(&self) -> u32 {
        self.programmed
    }

    /// Cuts the power in the middle of an operation: the one that follows `operations` complete ones.
    pub fn cut_after(&mut self, operations: u32, weak: Weak) {
        self.cut_at = Some(self.operations + operations);
        self.weak = weak;
    }

    /// Whether the power was cut.
    #[must_use]
    pub fn is_down(&self) -> bool {
        !self.powered
    }

    /// Checks the power; every access calls this first.
    ///
    /// # Errors
    /// [`PowerCut`] when the power is off.
    pub fn check_power(&self) -> Result<(), PowerCut> {
        if self.powered { Ok(()) } else { Err(PowerCut) }
    }

    /// Switches the power on and cancels a scheduled cut. Weak bits read as the last cut specified.
    pub fn power_up(&mut self) {
        (self.powered, self.cut_at) = (true, None);
        for word in &mut self.words {
            word.power_up(self.weak, self.random.u64(..));
        }
    }

    /// The content, byte by byte.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.value().to_le_bytes().into_iter().take(self.word)).collect()
    }

    /// Changes a byte without an operation, as radiation, wear or a foreign program would.
    pub fn disturb(&mut self, offset: usize, change: impl FnOnce(u8) -> u8) {
        self.words[offset / self.word].disturb(offset % self.word, change);
    }

    /// Reads bytes.
    ///
    /// # Errors
    /// [`PowerCut`] when the power is off.
    pub fn read(&self, offset: usize, bytes: &mut [u8]) -> Result<(), PowerCut> {
        self.check_power()?;
        let (mut rest, mut at) = (bytes, offset);
        while !rest.is_empty() {
            let word = self.words[at / self.word].value().to_le_bytes();
            let from_here = &word[at % self.word..self.word];
            let (chunk, next) = rest.split_at_mut(from_here.len().min(rest.len()));
            chunk.copy_from_slice(&from_here[..chunk.len()]);
            (rest, at) = (next, at + chunk.len());
        }
        Ok(())
    }

    /// Programs whole words, one operation each.
    ///
    /// # Errors
    /// [`PowerCut`] when the power is off, or goes off.
    ///
    /// # Panics
    /// When a word is neither erased nor programmed with zeros.
    pub fn program(&mut self, offset: usize, bytes: &[u8]) -> Result<(), PowerCut> {
        for (index, chunk) in (offset / self.word..).zip(bytes.chunks_exact(self.word)) {
            let target = chunk.iter().rev().fold(0, |target, byte| target << 8 | u64::from(*byte));
            let is_cut = self.begin()?;
            self.words[index].program(target, is_cut);
            self.check_power()?;
            self.programmed += 1;
        }
        Ok(())
    }

    /// Erases a unit, which is one operation.
    ///
    /// # Errors
    /// [`PowerCut`] when the power is off, or goes off.
    pub fn erase(&mut self, unit: Range<usize>) -> Result<(), PowerCut> {
        let is_cut = self.begin()?;
        for word in &mut self.words[unit.start / self.word..unit.end / self.word] {
            word.erase(is_cut);
        }
        self.check_power()
    }

    /// Counts an operation; `true` when the power is cut in it.
    fn begin(&mut self) -> Result<bool, PowerCut> {
        self.check_power()?;
        let is_cut = self.cut_at == Some(self.operations);
        self.operations += 1;
        self.powered = !is_cut;
        Ok(is_cut)
    }
}
