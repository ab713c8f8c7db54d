//! Sections and keys of a text, with their lines.

use std::cell::RefCell;

use configparser::ini::{Ini as Parser, IniDefault};

use crate::value::{number, repaired};
use crate::{Error, Problem};

/// A parsed text. Names of sections and keys are compared without case.
pub(crate) struct Ini<'a> {
    text: &'a str,
    parser: Parser,
    warnings: RefCell<Vec<Error>>,
}

impl<'a> Ini<'a> {
    pub(crate) fn parse(text: &'a str) -> Result<Ini<'a>, Error> {
        let text = text.trim_start_matches('\u{FEFF}');
        let mut parser = Parser::new_from_defaults(syntax());
        match parser.read(text.into()) {
            Ok(_) => Ok(Ini { text, parser, warnings: RefCell::default() }),
            Err(message) => {
                Err(Error { section: String::new(), key: "", line: None, problem: Problem::Syntax(message) })
            }
        }
    }

    /// The warnings so far, each once, in the order of the file. Those about missing sections come last.
    pub(crate) fn into_warnings(self) -> Vec<Error> {
        let mut warnings = self.warnings.into_inner();
        warnings.sort_by_key(|warning| (warning.line.is_none(), warning.line));
        warnings.dedup();
        warnings
    }

    /// All sections, in the order of the file.
    pub(crate) fn sections(&self) -> impl Iterator<Item = Section<'_>> {
        self.parser.get_map_ref().keys().map(|name| Section { ini: self, name })
    }

    /// A warning: a section is missing.
    pub(crate) fn warn_of(&self, section: &str, problem: Problem) {
        let warning = Error { section: section.into(), key: "", line: None, problem };
        self.warnings.borrow_mut().push(warning);
    }

    /// A section by its name in lower case.
    pub(crate) fn section(&self, name: &str) -> Option<Section<'_>> {
        let (name, _) = self.parser.get_map_ref().get_key_value(name)?;
        Some(Section { ini: self, name })
    }

    /// The section at the end of the text.
    pub(crate) fn last_section(&self) -> Option<Section<'_>> {
        let mut headers = self.text.lines().rev().filter_map(|line| line.trim().strip_prefix('['));
        self.section(headers.next()?.strip_suffix(']')?.trim().to_lowercase().as_str())
    }

    /// The last line where it has no line break and is not complete.
    pub(crate) fn broken_line(&self) -> Option<&str> {
        let line = self.text.rsplit('\n').next()?.trim();
        let is_section = line.starts_with('[') && line.ends_with(']');
        let is_complete = line.is_empty() || line.starts_with(';') || is_section || line.contains('=');
        (!is_complete).then_some(line)
    }

    /// The line of a key; without such a key, the line of the section. Of repeated keys the last one counts.
    fn line(&self, section: &str, key: &str) -> Option<usize> {
        let (mut inside, mut header, mut value) = (false, None, None);
        for (number, line) in (1..).zip(self.text.lines()) {
            let line = line.trim().to_lowercase();
            if let Some(rest) = line.strip_prefix('[') {
                inside = rest.rsplit_once(']').is_some_and(|(name, _)| name.trim() == section);
                header = if inside { Some(number) } else { header };
            } else if inside && line.split_once('=').is_some_and(|(name, _)| name.trim() == key) {
                value = Some(number);
            }
        }
        value.or(header)
    }
}

/// A comment has a line of its own. [`without_comment`] removes comments behind values.
fn syntax() -> IniDefault {
    let mut syntax = IniDefault::default();
    syntax.comment_symbols = vec![';'];
    syntax.inline_comment_symbols = Some(Vec::new());
    syntax.delimiters = vec!['='];
    syntax
}

/// A section of the text.
#[derive(Clone, Copy)]
pub(crate) struct Section<'a> {
    ini: &'a Ini<'a>,
    name: &'a str,
}

impl<'a> Section<'a> {
    /// The name in lower case.
    pub(crate) fn name(self) -> &'a str {
        self.name
    }

    /// All keys that have a value, in lower case, with their values.
    pub(crate) fn keys(self) -> impl Iterator<Item = (&'a str, &'a str)> {
        let keys = self.ini.parser.get_map_ref().get(self.name).into_iter().flatten();
        keys.filter_map(|(key, value)| Some((key.as_str(), without_comment(value.as_deref()?)?)))
    }

    /// The value of a key; `None` where the value is empty.
    pub(crate) fn get(self, key: &str) -> Option<&'a str> {
        let keys = self.ini.parser.get_map_ref().get(self.name)?;
        without_comment(keys.get(&key.to_ascii_lowercase())?.as_deref()?)
    }

    /// The value of a key. A missing key is a warning.
    pub(crate) fn required(self, key: &'static str) -> Option<&'a str> {
        let value = self.get(key);
        if value.is_none() {
            self.warn(key, Problem::Missing);
        }
        value
    }

    /// The number of a key; 0 without a key. A wrong number is a warning.
    pub(crate) fn number<T: TryFrom<i128> + Default>(self, key: &'static str) -> T {
        let Some(text) = self.get(key) else { return T::default() };
        let read = |text: &str| number(text).and_then(|value| T::try_from(value).ok());
        read(text).unwrap_or_else(|| {
            let bits = 8 * std::mem::size_of::<T>();
            self.wrong(key, text, format!("a number of at most {bits} bits"));
            repaired(text, read).unwrap_or_default()
        })
    }

    /// A warning: the key has a wrong value.
    pub(crate) fn wrong(self, key: &'static str, text: &str, expected: impl Into<String>) {
        self.warn(key, Problem::Value { text: text.into(), expected: expected.into() });
    }

    /// A warning about a key; with an empty key, about the section.
    pub(crate) fn warn(self, key: &'static str, problem: Problem) {
        let line = self.ini.line(self.name, &key.to_ascii_lowercase());
        let warning = Error { section: self.name.into(), key, line, problem };
        self.ini.warnings.borrow_mut().push(warning);
    }
}

/// Removes the comment that vendors write after a value, `0 ; off`. A semicolon inside a word is part of the word.
fn without_comment(value: &str) -> Option<&str> {
    let at =
        value.match_indices(';').map(|(at, _)| at).find(|&at| value[..at].ends_with([' ', '\t']) || at == 0);
    let value = value[..at.unwrap_or(value.len())].trim();
    (!value.is_empty()).then_some(value)
}
