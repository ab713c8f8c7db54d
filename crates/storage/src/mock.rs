//! A NOR flash for tests. It panics when a rule of the real flash is broken, counts operations, and loses power in the
//! middle of the one it is told to.
//!
//! What a cut leaves behind is modelled on the pessimistic side: the bits that were being changed are *weak*, they may
//! read as either value, and as another one after the next power-up, until the word is erased or programmed with zeros.
//! A word that was cut without a visible trace is therefore still known to the mock, and programming it with anything
//! but zeros is a broken rule.

use std::vec;
use std::vec::Vec;

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

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
}

#[derive(Clone, Copy, Debug)]
struct Word {
    value: u32,
    /// Bits of which nobody knows how they read.
    weak: u32,
    /// What the weak bits were before, and would have become.
    before: u32,
    after: u32,
    /// Nothing may be programmed before the next erase, save zeros over a `torn` word.
    used: bool,
    torn: bool,
    /// The erase of the unit was cut: nothing at all may be programmed.
    half_erased: bool,
}

const ERASED: Word =
    Word { value: !0, weak: 0, before: !0, after: !0, used: false, torn: false, half_erased: false };

/// A flash that is programmed in words of four bytes and erased in units of `ERASE` bytes.
#[derive(Clone, Debug)]
pub struct MockFlash<const ERASE: usize> {
    words: Vec<Word>,
    operations: u32,
    programmed: u32,
    erases: Vec<u32>,
    cut_at: Option<u32>,
    powered: bool,
    weak: Weak,
    random: u64,
}

impl<const ERASE: usize> MockFlash<ERASE> {
    /// An erased flash of `size` bytes. `seed` decides how random weak bits read.
    #[must_use]
    pub fn new(size: usize, seed: u64) -> Self {
        MockFlash {
            words: vec![ERASED; size / 4],
            operations: 0,
            programmed: 0,
            erases: vec![0; size / ERASE],
            cut_at: None,
            powered: true,
            weak: Weak::Random,
            random: seed,
        }
    }

    /// Programs (one word each) and erases (one unit each) so far.
    #[must_use]
    pub fn operations(&self) -> u32 {
        self.operations
    }

    /// Words programmed so far.
    #[must_use]
    pub fn programmed(&self) -> u32 {
        self.programmed
    }

    /// How often each erase unit was erased.
    #[must_use]
    pub fn erases(&self) -> &[u32] {
        &self.erases
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
        self.powered = true;
        self.cut_at = None;
        for index in 0..self.words.len() {
            let random = self.next_random();
            let Some(word) = self.words.get_mut(index) else { continue };
            let reads = match self.weak {
                Weak::Before => word.before,
                Weak::After => word.after,
                Weak::Random => random,
            };
            word.value = (word.value & !word.weak) | (reads & word.weak);
        }
    }

    /// The content, byte by byte.
    #[must_use]
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.value.to_le_bytes()).collect()
    }

    /// Changes the content behind the store's back, as radiation, wear or a foreign program would.
    pub fn disturb(&mut self, offset: usize, change: impl FnOnce(u8) -> u8) {
        if let Some(word) = self.words.get_mut(offset / 4) {
            let mut bytes = word.value.to_le_bytes();
            bytes[offset % 4] = change(bytes[offset % 4]);
            word.value = u32::from_le_bytes(bytes);
        }
    }

    /// Counts an operation; tells whether it is the one that is cut.
    fn begin(&mut self) -> Result<bool, PowerCut> {
        if !self.powered {
            return Err(PowerCut);
        }
        let cut = self.cut_at == Some(self.operations);
        self.operations += 1;
        self.powered = !cut;
        Ok(cut)
    }

    fn program(&mut self, index: usize, target: u32) -> Result<(), PowerCut> {
        let cut = self.begin()?;
        let word = &mut self.words[index];
        assert!(!word.half_erased, "word {index} is programmed after its erase was cut");
        assert!(!word.used || (word.torn && target == 0), "word {index} is programmed twice");
        assert!(
            target == 0 || word.value == !0,
            "word {index} is programmed though it does not read as erased"
        );
        let (before, after) = (word.value, word.value & target);
        if cut {
            let weak = word.weak | (before ^ after);
            *word = Word { value: before, weak, before, after, used: true, torn: true, half_erased: false };
            return Err(PowerCut);
        }
        *word = Word { value: after, used: true, ..ERASED };
        self.programmed += 1;
        Ok(())
    }

    fn erase_unit(&mut self, unit: usize) -> Result<(), PowerCut> {
        let cut = self.begin()?;
        self.erases[unit] += 1;
        for word in &mut self.words[unit * ERASE / 4..(unit + 1) * ERASE / 4] {
            let (before, weak) = (word.value, word.weak | !word.value);
            *word =
                if cut { Word { value: before, weak, before, half_erased: true, ..ERASED } } else { ERASED };
        }
        if cut { Err(PowerCut) } else { Ok(()) }
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

impl<const ERASE: usize> ErrorType for MockFlash<ERASE> {
    type Error = PowerCut;
}

impl<const ERASE: usize> ReadNorFlash for MockFlash<ERASE> {
    const READ_SIZE: usize = 4;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerCut> {
        check_read(self, offset, bytes.len()).expect("a read within the flash, of whole words");
        if !self.powered {
            return Err(PowerCut);
        }
        for (chunk, word) in bytes.chunks_mut(4).zip(&self.words[offset as usize / 4..]) {
            chunk.copy_from_slice(&word.value.to_le_bytes());
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.words.len() * 4
    }
}

impl<const ERASE: usize> NorFlash for MockFlash<ERASE> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = ERASE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerCut> {
        check_erase(self, from, to).expect("an erase of whole units within the flash");
        (from as usize / ERASE..to as usize / ERASE).try_for_each(|unit| self.erase_unit(unit))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerCut> {
        check_write(self, offset, bytes.len()).expect("a write of whole words within the flash");
        for (index, chunk) in (offset as usize / 4..).zip(bytes.chunks(4)) {
            self.program(index, u32::from_le_bytes(chunk.try_into().expect("four bytes")))?;
        }
        Ok(())
    }
}
