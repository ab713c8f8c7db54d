//! The pre-defined error field, object 1003h.

/// The most errors in the list.
pub(crate) const DEPTH: u8 = 10;

/// The last errors, each in the four bytes of an SDO upload.
#[derive(Debug)]
pub(crate) struct History {
    count: u8,
    /// The number of errors that the dictionary has entries for.
    depth: u8,
    /// Position of the newest error in the ring buffer. Older errors precede it.
    newest: u8,
    errors: [[u8; 4]; DEPTH as usize],
}

impl History {
    pub(crate) const fn new() -> History {
        History { count: 0, depth: DEPTH, newest: 0, errors: [[0; 4]; DEPTH as usize] }
    }

    /// Adds an error: its code, and two bytes of its error field.
    pub(crate) fn push(&mut self, error: [u8; 4]) {
        self.newest = if self.newest + 1 < DEPTH { self.newest + 1 } else { 0 };
        if let Some(place) = self.errors.get_mut(usize::from(self.newest)) {
            *place = error;
        }
        self.count = (self.count + 1).min(self.depth);
    }

    /// Takes the number of entries of the dictionary, at most ten.
    pub(crate) fn set_depth(&mut self, depth: u8) {
        self.depth = depth;
    }

    pub(crate) fn clear(&mut self) {
        self.count = 0;
    }

    /// Sub-index 0, the number of errors.
    pub(crate) fn count(&self) -> &u8 {
        &self.count
    }

    /// Sub-index 1 and up, the newest error first; `None` beyond the oldest error.
    pub(crate) fn error(&self, sub: u8) -> Option<&[u8; 4]> {
        let age = sub.checked_sub(1).filter(|&age| age < self.count)?;
        self.errors.get(usize::from((self.newest + DEPTH - age) % DEPTH))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_errors_newest_first() {
        let mut history = History::new();
        (1..=12).for_each(|code| history.push([code, 0, 1, 2]));
        assert_eq!(*history.count(), 10);
        assert_eq!(history.error(1), Some(&[12, 0, 1, 2]));
        assert_eq!(history.error(10), Some(&[3, 0, 1, 2]));
        assert_eq!(history.error(11), None);
        assert_eq!(history.error(0), None);
        history.clear();
        assert_eq!((*history.count(), history.error(1)), (0, None));
    }

    #[test]
    fn a_list_of_two_has_two_errors() {
        let mut history = History::new();
        history.set_depth(2);
        (1..=12).for_each(|code| history.push([code, 0, 1, 2]));
        assert_eq!((*history.count(), history.error(2), history.error(3)), (2, Some(&[11, 0, 1, 2]), None));
    }
}
