//! The data sheet of the device.

use eds::{Class, Eds, Entry};

use super::Subject;
use super::verdict::{Outcome, skip};

impl Subject<'_> {
    /// The data sheet; skipped without a data sheet.
    pub(in crate::check) fn sheet(&self) -> Outcome<Eds> {
        self.setup.sheet.clone().ok_or_else(|| skip("no data sheet: give it with --eds"))
    }

    /// The entries of the data sheet that fulfil a condition.
    pub(in crate::check) fn entries(&self, is_wanted: impl Fn(&Entry) -> bool) -> Outcome<Vec<Entry>> {
        Ok(self.sheet()?.entries().filter(|entry| is_wanted(entry)).cloned().collect())
    }

    /// The first entry of the data sheet that fulfils a condition; skipped without such an entry.
    pub(in crate::check) fn entry(&self, what: &str, is_wanted: impl Fn(&Entry) -> bool) -> Outcome<Entry> {
        let sheet = self.sheet()?;
        sheet
            .entries()
            .find(|entry| is_wanted(entry))
            .cloned()
            .ok_or_else(|| skip(format!("the data sheet has no {what}")))
    }
}

/// The size of a value in bytes, for a number type; `None` for text and bytes.
pub(in crate::check) fn size(entry: &Entry) -> Option<usize> {
    match entry.data_type.class() {
        Class::Signed(bits) | Class::Unsigned(bits) | Class::Real(bits) => {
            Some(usize::from(bits).div_ceil(8))
        }
        Class::Text | Class::Bytes => None,
    }
}
