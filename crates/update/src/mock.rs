//! A flash for tests: sectors of different sizes, an erase that takes its time, and a loss of power in the middle of the
//! operation it is told to. It panics when a rule of the real flash is broken.
//!
//! What a cut leaves behind is modelled on the pessimistic side: the bits that were being changed are *weak*, they may
//! read as either value, and as another one after the next power-up, until the word is erased or programmed with zeros.

use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{ErrorType, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_read};

use crate::flash::Flash;

/// The power is off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerCut;

impl NorFlashError for PowerCut {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// How the weak bits read at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    /// As before the operation that was cut.
    Before,
    /// As that operation would have left them.
    After,
    /// Each by chance, drawn again at every power-up.
    Random,
    /// All of a word by chance as before or as after, drawn again at every power-up: what makes a word that was cut once
    /// look whole and once not.
    Either,
}

impl Weak {
    /// All of them.
    pub const ALL: [Weak; 4] = [Weak::Before, Weak::After, Weak::Random, Weak::Either];
}

/// What may be programmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Anything.
    Erased,
    /// Zeros.
    Programmed,
    /// Zeros, and then it is still no erased word.
    HalfErased,
}

#[derive(Clone, Copy, Debug)]
struct Word {
    value: u32,
    /// Bits of which nobody knows how they read, what they were and what they would have become.
    weak: u32,
    before: u32,
    after: u32,
    used: Use,
}

const ERASED: Word = Word { value: !0, weak: 0, before: !0, after: !0, used: Use::Erased };

/// Polls that an erase takes.
const ERASE_POLLS: u32 = 3;

/// A flash of words of four bytes.
#[derive(Clone, Debug)]
pub struct MockFlash {
    words: Vec<Word>,
    sectors: Vec<core::ops::Range<usize>>,
    busy: u32,
    operations: u32,
    cut_at: Option<u32>,
    powered: bool,
    weak: Weak,
    random: u64,
}

impl MockFlash {
    /// An erased flash with sectors of these sizes in bytes. `seed` decides how random weak bits read.
    #[must_use]
    pub fn new(sectors: &[usize], seed: u64) -> MockFlash {
        let mut end = 0;
        let ranges = sectors.iter().map(|size| {
            end += size / 4;
            end - size / 4..end
        });
        MockFlash {
            sectors: ranges.collect(),
            words: vec![ERASED; sectors.iter().sum::<usize>() / 4],
            busy: 0,
            operations: 0,
            cut_at: None,
            powered: true,
            weak: Weak::Random,
            random: seed,
        }
    }

    /// Programs (one word each) and erases (one sector each) so far.
    #[must_use]
    pub fn operations(&self) -> u32 {
        self.operations
    }

    /// Cuts the power in the middle of the operation that comes after `operations` more.
    pub fn cut_after(&mut self, operations: u32, weak: Weak) {
        self.cut_at = Some(self.operations + operations);
        self.weak = weak;
    }

    /// Whether the power was cut.
    #[must_use]
    pub fn is_down(&self) -> bool {
        !self.powered
    }

    /// Power again, and no cut to come. Weak bits read as `weak` of the last cut says.
    pub fn power_up(&mut self) {
        (self.powered, self.cut_at, self.busy) = (true, None, 0);
        for index in 0..self.words.len() {
            let random = self.next_random();
            let word = &mut self.words[index];
            let reads = match (self.weak, random & 1) {
                (Weak::Random, _) => random,
                (Weak::Before, _) | (Weak::Either, 0) => word.before,
                (Weak::After | Weak::Either, _) => word.after,
            };
            word.value = (word.value & !word.weak) | (reads & word.weak);
        }
    }

    /// The content, byte by byte.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.value.to_le_bytes()).collect()
    }

    /// Changes a byte behind the driver's back, as radiation or wear would.
    pub fn disturb(&mut self, offset: usize, change: impl FnOnce(u8) -> u8) {
        let word = &mut self.words[offset / 4].value;
        let mut bytes = word.to_le_bytes();
        bytes[offset % 4] = change(bytes[offset % 4]);
        *word = u32::from_le_bytes(bytes);
    }

    /// Counts an operation; tells whether it is the one that is cut.
    fn begin(&mut self) -> Result<bool, PowerCut> {
        if !self.powered {
            return Err(PowerCut);
        }
        assert_eq!(self.busy, 0, "the flash erases");
        let cut = self.cut_at == Some(self.operations);
        self.operations += 1;
        self.powered = !cut;
        Ok(cut)
    }

    fn program_word(&mut self, index: usize, target: u32) -> Result<(), PowerCut> {
        let cut = self.begin()?;
        let word = &mut self.words[index];
        assert!(word.used == Use::Erased || target == 0, "word {index} is programmed twice");
        let used = if word.used == Use::HalfErased { Use::HalfErased } else { Use::Programmed };
        let (before, after) = (word.value, word.value & target);
        if cut {
            *word = Word { value: before, weak: word.weak | (before ^ after), before, after, used };
            return Err(PowerCut);
        }
        *word = Word { value: after, weak: 0, before: after, after, used };
        Ok(())
    }

    fn next_random(&mut self) -> u32 {
        self.random = splitmix(self.random);
        (self.random >> 32) as u32
    }
}

/// One step of the `SplitMix64` generator's sequence, mixed.
#[must_use]
pub fn splitmix(state: u64) -> u64 {
    let mut z = state.wrapping_add(0x9E37_79B9_7F4A_7C15);
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

impl ErrorType for MockFlash {
    type Error = PowerCut;
}

impl ReadNorFlash for MockFlash {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("a read within the flash, of whole words");
        if !self.powered {
            return Err(PowerCut);
        }
        assert_eq!(self.busy, 0, "the flash erases");
        let words = &self.words[offset as usize / 4..];
        bytes
            .chunks_exact_mut(4)
            .zip(words)
            .for_each(|(to, word)| to.copy_from_slice(&word.value.to_le_bytes()));
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.words.len() * 4
    }
}

impl Flash for MockFlash {
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("words within the flash");
        for (index, word) in bytes.chunks_exact(4).enumerate() {
            let target = u32::from_le_bytes(word.try_into().expect("four bytes"));
            self.program_word(offset as usize / 4 + index, target)?;
        }
        Ok(())
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), PowerCut> {
        let cut = self.begin()?;
        let start = offset as usize / 4;
        let sector = self.sectors.iter().find(|sector| sector.start == start).expect("the start of a sector");
        for word in &mut self.words[sector.clone()] {
            let (before, weak) = (word.value, word.weak | !word.value);
            let half = Word { value: before, weak, before, after: !0, used: Use::HalfErased };
            *word = if cut { half } else { ERASED };
        }
        self.busy = ERASE_POLLS;
        if cut { Err(PowerCut) } else { Ok(()) }
    }

    fn is_busy(&mut self) -> Result<bool, PowerCut> {
        self.busy = self.busy.saturating_sub(1);
        if self.powered { Ok(self.busy > 0) } else { Err(PowerCut) }
    }
}
