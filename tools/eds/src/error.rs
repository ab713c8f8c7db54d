//! Errors and warnings of a data sheet.

use thiserror::Error;

/// An error or a warning of a data sheet, and its place.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("{}{problem}", self.place())]
pub struct Error {
    /// The section, in lower case; empty where the text is no INI file at all.
    pub section: String,
    /// The key; empty where the whole section is meant.
    pub key: &'static str,
    /// The line, from 1, where it is known.
    pub line: Option<usize>,
    /// The kind of error.
    pub problem: Problem,
}

/// A kind of mistake in a data sheet.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Problem {
    /// The text is not made of sections and keys.
    #[error("{0}")]
    Syntax(String),
    /// A required key is missing.
    #[error("is missing")]
    Missing,
    /// A value that is not of its type.
    #[error("\"{text}\" is not {expected}")]
    Value {
        /// The value.
        text: String,
        /// The kind of value that is expected.
        expected: String,
    },
    /// A value that is not of its type, and of which no part can be read.
    #[error("\"{text}\" is not {expected}, and is not read")]
    NoValue {
        /// The value.
        text: String,
        /// The kind of value that is expected.
        expected: String,
    },
    /// A sub-index whose index has no section.
    #[error("the object has no section of its own")]
    Orphan,
    /// A listed object whose index has no section.
    #[error("{first:04X}h is listed and has no section{}", and_more(*.more))]
    NoObject {
        /// The first such object.
        first: u16,
        /// The number of others.
        more: usize,
    },
    /// Fewer objects or sub-indices than the file counts.
    #[error("{counted} are counted and {found} are there")]
    Fewer {
        /// The number that the file tells.
        counted: usize,
        /// The number in the file.
        found: usize,
    },
    /// A last line that is cut off.
    #[error("the file is cut off in its last line, \"{0}\"")]
    BrokenLine(String),
    /// A last section without the keys at the end of the others.
    #[error("the file is cut off in its last section, before {0}")]
    NoEnd(String),
    /// A missing list of objects, beside other lists.
    #[error("the list of objects is missing")]
    NoList,
}

impl Error {
    /// Whether a configuration out of this file is incomplete: a part of the file is missing, as of a truncated one, or the
    /// value of a parameter cannot be read.
    #[must_use]
    pub fn is_loss(&self) -> bool {
        match self.problem {
            Problem::NoObject { .. }
            | Problem::Fewer { .. }
            | Problem::NoList
            | Problem::BrokenLine(_)
            | Problem::NoEnd(_) => true,
            Problem::NoValue { .. } => self.key == "ParameterValue",
            _ => false,
        }
    }

    fn place(&self) -> String {
        let Error { section, key, line, .. } = self;
        let line = line.map(|line| format!("line {line}: ")).unwrap_or_default();
        match (section.is_empty(), key.is_empty()) {
            (true, _) => line,
            (false, true) => format!("{line}[{section}]: "),
            (false, false) => format!("{line}[{section}] {key}: "),
        }
    }
}

fn and_more(count: usize) -> String {
    if count == 0 { String::new() } else { format!(", and {count} more") }
}
