//! Look-up of an entry by a text that a person types.

use canopen::sdo::Multiplexer;
use thiserror::Error;

use crate::{Eds, Entry};

/// Why a look-up has not found exactly one entry.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum LookupError {
    /// No entry has this address.
    #[error("the data sheet has no object {:04X}h:{}", .0.index, .0.sub)]
    Address(Multiplexer),
    /// No entry has this name.
    #[error("the data sheet has no object called \"{name}\"{}", list(" (it has ", similar, ")"))]
    Name {
        /// The name that was looked for.
        name: String,
        /// Names that contain the name, else names that are like it.
        similar: Vec<String>,
    },
    /// The text begins as an address, and the rest is wrong.
    #[error("\"{text}\" is no address: an address is four hexadecimal digits and a sub-index up to 255, such as {:04X}h:{}", .example.index, .example.sub)]
    NoAddress {
        /// The text.
        text: String,
        /// The address that may be meant, else any.
        example: Multiplexer,
    },
    /// Several entries have this name.
    #[error("\"{name}\" is the name of several objects{}", list(": ", candidates, ""))]
    Ambiguous {
        /// The name that was looked for.
        name: String,
        /// All entries that have the name.
        candidates: Vec<String>,
    },
}

/// How many names an error lists.
const LISTED: usize = 16;
/// Names with a lower nearness are not suggested.
const NEAR: f64 = 0.7;

fn list(before: &str, names: &[String], after: &str) -> String {
    if names.is_empty() { String::new() } else { format!("{before}{}{after}", names.join(", ")) }
}

impl Eds {
    /// The entry that a person means: an [`address`], `Error register`, `Identity/Vendor-ID`, or only `Vendor-ID`
    /// where no other entry is called so; else two or more words of its name in any order. The name of a record or an
    /// array is its sub-index 0. Case does not matter.
    ///
    /// # Errors
    /// When no entry fits, or more than one.
    pub fn find(&self, query: &str) -> Result<&Entry, LookupError> {
        let name = query.trim().to_lowercase();
        let by_path =
            self.named(|entry| self.path(entry).to_lowercase() == name || self.is_head(entry, &name));
        let by_name = || self.named(|entry| entry.name.to_lowercase() == name);
        let by_words = || if address(query).is_none() { self.with_words(&name) } else { Vec::new() };
        let found =
            [by_path, by_name(), by_words()].into_iter().find(|found| !found.is_empty()).unwrap_or_default();
        match (&found[..], address(query)) {
            ([entry], _) => Ok(entry),
            ([], Some(at)) => self.get(at.index, at.sub).ok_or(LookupError::Address(at)),
            ([], None) => Err(self.unknown(query, &name)),
            _ => {
                Err(LookupError::Ambiguous { name: query.into(), candidates: self.addresses(&found, query) })
            }
        }
    }

    fn unknown(&self, query: &str, name: &str) -> LookupError {
        let similar = self.similar(name);
        if similar.is_empty() && is_like_an_address(name) {
            let example = mapped(name).unwrap_or(Multiplexer { index: 0x1018, sub: 1 });
            return LookupError::NoAddress { text: query.into(), example };
        }
        LookupError::Name { name: query.into(), similar }
    }

    /// The name by which [`Eds::find`] finds an entry: `Error register`, `Identity/Vendor-ID`.
    #[must_use]
    pub fn path(&self, entry: &Entry) -> String {
        match self.objects.get(&entry.index) {
            Some(object) if object.object_type.has_subs() => format!("{}/{}", object.name, entry.name),
            _ => entry.name.clone(),
        }
    }

    fn named(&self, is_meant: impl Fn(&Entry) -> bool) -> Vec<&Entry> {
        self.entries().filter(|entry| is_meant(entry)).collect()
    }

    /// Whether an entry is sub-index 0 of an object of this name.
    fn is_head(&self, entry: &Entry, name: &str) -> bool {
        let object = self.objects.get(&entry.index);
        entry.sub == 0 && object.is_some_and(|object| object.name.to_lowercase() == name)
    }

    /// The entries whose path has all words of a text; the text has at least two.
    fn with_words(&self, text: &str) -> Vec<&Entry> {
        let wanted: Vec<&str> = words(text).collect();
        let has_all = |entry: &Entry| {
            let path = self.path(entry).to_lowercase();
            let own: Vec<&str> = words(&path).collect();
            wanted.iter().all(|word| own.contains(word))
        };
        if wanted.len() < 2 { Vec::new() } else { self.named(has_all) }
    }

    /// Paths that contain a text; where no path does, paths that are like it. The nearest come first.
    fn similar(&self, text: &str) -> Vec<String> {
        let near: Vec<(f64, String)> =
            self.entries().map(|entry| (self.nearness(entry, text), self.path(entry))).collect();
        let contain = |(_, path): &&(f64, String)| path.to_lowercase().contains(text);
        let mut found: Vec<(f64, String)> = near.iter().filter(contain).cloned().collect();
        if found.is_empty() {
            found = near.into_iter().filter(|(nearness, _)| *nearness >= NEAR).collect();
        }
        // The shortest of equally near names is first: the text is a larger part of that name.
        found.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.len().cmp(&b.1.len())));
        listed(found.into_iter().map(|(_, path)| path))
    }

    /// How alike a text is to the name, the path or a word of an entry: 1 for equal.
    fn nearness(&self, entry: &Entry, text: &str) -> f64 {
        let (name, path) = (entry.name.to_lowercase(), self.path(entry).to_lowercase());
        let whole =
            [name.as_str(), path.as_str()].map(|own| strsim::normalized_damerau_levenshtein(own, text));
        let word =
            words(&path).map(|word| strsim::normalized_damerau_levenshtein(word, text)).fold(0.0, f64::max);
        // A match of one word counts less than a match of the whole name.
        whole.into_iter().fold(0.95 * word, f64::max)
    }

    /// The addresses and paths of the entries, the nearest to the query first.
    fn addresses(&self, entries: &[&Entry], query: &str) -> Vec<String> {
        let line = |entry: &&Entry| format!("{:04X}h:{} {}", entry.index, entry.sub, self.path(entry));
        let text = query.trim().to_lowercase();
        let mut sorted = entries.to_vec();
        sorted.sort_by(|a, b| self.nearness(b, &text).total_cmp(&self.nearness(a, &text)));
        listed(sorted.iter().map(line))
    }
}

/// The first names of a list, and the number of the others.
fn listed(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut names: Vec<String> = names.collect();
    let more = names.len().saturating_sub(LISTED);
    if more > 0 {
        names.truncate(LISTED);
        names.push(format!("and {more} more"));
    }
    names
}

/// The words of a text: runs of letters and digits.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|char: char| !char.is_alphanumeric()).filter(|word| !word.is_empty())
}

/// An index and a sub-index: `1018`, `0x1018`, `1018h`, each with `:1` (decimal, or `:0x1`) or `sub1` (hexadecimal, as
/// in a data sheet). Without a sub-index the sub-index is 0.
#[must_use]
pub fn address(text: &str) -> Option<Multiplexer> {
    let text = text.trim().to_ascii_lowercase();
    let digits = text.strip_prefix("0x").unwrap_or(&text);
    let (index, rest) = digits.split_at_checked(4)?;
    let rest = rest.strip_prefix('h').unwrap_or(rest);
    let sub = match (rest.strip_prefix("sub"), rest.strip_prefix(':')) {
        (Some(sub), _) => hex(sub)?,
        (_, Some(sub)) => sub.strip_prefix("0x").map_or_else(|| decimal(sub), hex)?,
        _ if rest.is_empty() => 0,
        _ => return None,
    };
    Some(Multiplexer { index: hex(index)?, sub: u8::try_from(sub).ok()? })
}

/// Whether a text is one word that begins with a digit.
fn is_like_an_address(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_digit()) && !text.contains(char::is_whitespace)
}

/// The object in the number of a mapping entry: index, sub-index and bits.
fn mapped(text: &str) -> Option<Multiplexer> {
    let text = text.strip_prefix("0x").unwrap_or(text);
    let digits = text.strip_suffix('h').unwrap_or(text);
    let (index, rest) = digits.split_at_checked(4).filter(|_| digits.len() == 8)?;
    let (sub, bits) = rest.split_at_checked(2)?;
    hex(bits)?;
    Some(Multiplexer { index: hex(index)?, sub: u8::try_from(hex(sub)?).ok()? })
}

fn hex(digits: &str) -> Option<u16> {
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    if is_plain { u16::from_str_radix(digits, 16).ok() } else { None }
}

fn decimal(digits: &str) -> Option<u16> {
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_digit());
    if is_plain { digits.parse().ok() } else { None }
}
