//! One word of the flash.

/// How the weak bits read at power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weak {
    /// As before the cut operation.
    Before,
    /// As after the completed operation.
    After,
    /// Each bit at random, drawn again at every power-up.
    Random,
    /// All bits of a word at random as before or as after, drawn again at every power-up: the word looks whole after
    /// one power-up and incomplete after another.
    Either,
}

impl Weak {
    /// All ways.
    pub const ALL: [Weak; 4] = [Weak::Before, Weak::After, Weak::Random, Weak::Either];
}

/// The values that may be programmed until the next erase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Any value.
    Erased,
    /// Only zeros.
    Programmed,
    /// Only zeros, and the word still counts as not erased afterwards, because its erase was cut.
    HalfErased,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Word {
    /// The value of an erased word: all ones, as many as the word has bits.
    erased: u64,
    value: u64,
    /// Bits with an uncertain value; `before` and `after` are the values before and after the cut operation.
    weak: u64,
    before: u64,
    after: u64,
    used: Use,
}

impl Word {
    /// An erased word of `bytes` bytes, 8 at most.
    pub(crate) fn erased(bytes: usize) -> Word {
        let erased = u64::MAX >> (64 - 8 * bytes);
        Word { erased, value: erased, weak: 0, before: erased, after: erased, used: Use::Erased }
    }

    pub(crate) fn value(&self) -> u64 {
        self.value
    }

    pub(crate) fn power_up(&mut self, weak: Weak, random: u64) {
        let reads = match (weak, random & 1) {
            (Weak::Random, _) => random,
            (Weak::Before, _) | (Weak::Either, 0) => self.before,
            (Weak::After | Weak::Either, _) => self.after,
        };
        self.value = (self.value & !self.weak) | (reads & self.weak);
    }

    pub(crate) fn disturb(&mut self, byte: usize, change: impl FnOnce(u8) -> u8) {
        let mut bytes = self.value.to_le_bytes();
        bytes[byte] = change(bytes[byte]);
        self.value = u64::from_le_bytes(bytes);
    }

    pub(crate) fn program(&mut self, target: u64, is_cut: bool) {
        assert!(target == 0 || self.used == Use::Erased, "a word is programmed that is not erased");
        assert!(
            target == 0 || self.value == self.erased,
            "a word is programmed that does not read as erased"
        );
        let used = if self.used == Use::HalfErased { Use::HalfErased } else { Use::Programmed };
        let (before, after) = (self.value, self.value & target);
        *self = if is_cut {
            Word { value: before, weak: self.weak | (before ^ after), before, after, used, ..*self }
        } else {
            Word { value: after, weak: 0, before: after, after, used, ..*self }
        };
    }

    pub(crate) fn erase(&mut self, is_cut: bool) {
        let (before, erased) = (self.value, self.erased);
        let weak = self.weak | (before ^ erased);
        *self = if is_cut {
            Word { value: before, weak, before, after: erased, used: Use::HalfErased, erased }
        } else {
            Word { value: erased, weak: 0, before: erased, after: erased, used: Use::Erased, erased }
        };
    }
}
