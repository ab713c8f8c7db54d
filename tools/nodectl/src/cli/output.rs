//! Results: text for people, JSON for scripts.

use std::fmt::Display;
use std::io::{self, IsTerminal, Write};

use serde::Serialize;

use crate::text::visible_lines;

/// The destination and the form of results.
pub struct Output {
    to: Box<dyn Write>,
    json: bool,
}

impl Output {
    /// The standard output.
    #[must_use]
    pub fn standard(json: bool) -> Output {
        Output::new(io::stdout(), json)
    }

    /// An output to any destination.
    pub fn new(to: impl Write + 'static, json: bool) -> Output {
        Output { to: Box::new(to), json }
    }

    /// Whether a person reads the output.
    pub(super) fn is_interactive(&self) -> bool {
        !self.json && io::stdout().is_terminal()
    }

    /// Prints a result.
    pub(super) fn print(&mut self, result: &(impl Serialize + Display)) -> io::Result<()> {
        if self.json {
            serde_json::to_writer(&mut self.to, result)?;
        } else {
            // Texts of a device, a file or a network are escaped, because control characters could change the terminal.
            write!(self.to, "{}", visible_lines(&result.to_string()))?;
        }
        writeln!(self.to)?;
        self.to.flush()
    }

    /// Prints a line of JSON.
    pub(super) fn json(&mut self, value: &serde_json::Value) -> io::Result<()> {
        writeln!(self.to, "{value}")?;
        self.to.flush()
    }

    /// Writes bytes unchanged.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.to.write_all(bytes)?;
        self.to.flush()
    }
}

/// An identification or a code in hexadecimal digits.
pub(super) fn hex(value: Option<u32>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:08X}h"))
}
