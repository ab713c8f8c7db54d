//! One word.

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

/// What may be programmed until the next erase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Use {
    /// Anything.
    Erased,
    /// Zeros.
    Programmed,
    /// Zeros, and then it is still no erased word: its erase was cut.
    HalfErased,
}

#[derive(Clone, Copy, Debug)]
pub(crate) struct Word {
    value: u32,
    /// Bits of which nobody knows how they read, what they were and what they would have become.
    weak: u32,
    before: u32,
    after: u32,
    used: Use,
}

impl Word {
    pub(crate) const ERASED: Word = Word { value: !0, weak: 0, before: !0, after: !0, used: Use::Erased };

    pub(crate) fn value(&self) -> u32 {
        self.value
    }

    pub(crate) fn power_up(&mut self, weak: Weak, random: u32) {
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
        self.value = u32::from_le_bytes(bytes);
    }

    pub(crate) fn program(&mut self, target: u32, is_cut: bool) {
        assert!(target == 0 || self.used == Use::Erased, "a word is programmed that is not erased");
        assert!(target == 0 || self.value == !0, "a word is programmed that does not read as erased");
        let used = if self.used == Use::HalfErased { Use::HalfErased } else { Use::Programmed };
        let (before, after) = (self.value, self.value & target);
        *self = if is_cut {
            Word { value: before, weak: self.weak | (before ^ after), before, after, used }
        } else {
            Word { value: after, weak: 0, before: after, after, used }
        };
    }

    pub(crate) fn erase(&mut self, is_cut: bool) {
        let (before, weak) = (self.value, self.weak | !self.value);
        let half = Word { value: before, weak, before, after: !0, used: Use::HalfErased };
        *self = if is_cut { half } else { Word::ERASED };
    }
}
