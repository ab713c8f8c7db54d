//! A set of PDOs by number: the hot paths visit those that exist and no others.

/// A set of the numbers 0 to 7.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PdoSet(u8);

impl PdoSet {
    pub(crate) const EMPTY: PdoSet = PdoSet(0);

    /// Puts a number in or takes it out. Numbers above 7 are in no set.
    #[inline(never)]
    pub(crate) fn set(&mut self, number: u8, contains: bool) {
        let bit = 1_u8.checked_shl(number.into()).unwrap_or(0);
        self.0 = if contains { self.0 | bit } else { self.0 & !bit };
    }

    /// The numbers in the set, ascending.
    pub(crate) fn iter(self) -> impl Iterator<Item = u8> {
        let mut rest = self.0;
        core::iter::from_fn(move || {
            let lowest = rest.trailing_zeros();
            rest &= rest.checked_sub(1)?;
            u8::try_from(lowest).ok()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_go_in_and_out() {
        let mut set = PdoSet::EMPTY;
        for number in [7, 0, 3, 8, 255] {
            set.set(number, true);
        }
        assert!(set.iter().eq([0, 3, 7]));
        set.set(3, false);
        assert!(set.iter().eq([0, 7]));
    }
}
