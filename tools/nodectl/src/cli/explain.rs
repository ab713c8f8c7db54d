//! `nodectl explain`

use std::fmt;

use canopen::sdo::Abort;
use clap::Args;
use serde::Serialize;

use super::{Failure, Session};
use crate::explain::{self, abort, emergencies};
use crate::meaning::error_code;

/// Explains an EMCY code (four hexadecimal digits) or an SDO abort code (eight): meaning, cause and remedy.
///
/// Cause and remedy are those of the nodes of this project. A code of another device has its meaning of CiA 301.
#[derive(Debug, Args)]
pub(super) struct Explain {
    /// The code, as 8130, 8130h, 0x08000022 or "0800 0022h"; without one, all EMCY codes of the nodes of this project
    code: Option<String>,
}

/// The meaning of a code.
#[derive(Serialize)]
struct Meaning {
    code: String,
    detail: Option<u8>,
    meaning: String,
    field: &'static str,
    cause: &'static str,
    remedy: &'static str,
}

/// The two kinds of codes, which differ in their length.
enum Code {
    Emergency(u16),
    Abort(u32),
}

impl Explain {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        for meaning in self.meanings()? {
            session.print(&meaning)?;
        }
        Ok(())
    }

    fn meanings(&self) -> Result<Vec<Meaning>, Failure> {
        let Some(text) = &self.code else { return Ok(emergencies().iter().map(Meaning::of_row).collect()) };
        match code(text) {
            Some(Code::Emergency(code)) => {
                let rows = emergencies().iter().filter(|row| row.code == code);
                let own: Vec<Meaning> = rows.map(Meaning::of_row).collect();
                let of_class = || vec![Meaning::new(format!("EMCY {code:04X}h"), error_code(code))];
                Ok(if own.is_empty() { of_class() } else { own })
            }
            Some(Code::Abort(code)) => {
                let name = format!("SDO abort {:04X} {:04X}h", code >> 16, code & 0xFFFF);
                let known = Abort::ALL.into_iter().find(|abort| abort.code() == code);
                let meaning = known.map_or("not defined by CiA 301", Abort::meaning);
                let (cause, remedy) = abort(code).map_or(("", ""), |row| (&row.cause, &row.remedy));
                Ok(vec![Meaning { cause, remedy, ..Meaning::new(name, meaning) }])
            }
            None => Err(Failure::Usage(format!(
                "{text:?} is no code: four hexadecimal digits of an EMCY, or eight of an abort"
            ))),
        }
    }
}

impl Meaning {
    fn new(code: String, meaning: impl Into<String>) -> Meaning {
        Meaning { code, detail: None, meaning: meaning.into(), field: "", cause: "", remedy: "" }
    }

    fn of_row(row: &'static explain::Emergency) -> Meaning {
        let explain::Emergency { code, detail, name, field, cause, remedy, .. } = row;
        Meaning { detail: *detail, field, cause, remedy, ..Meaning::new(format!("EMCY {code:04X}h"), name) }
    }
}

/// The code in a text, by its number of digits.
fn code(text: &str) -> Option<Code> {
    let digits: String =
        text.trim().to_ascii_lowercase().chars().filter(|char| !char.is_whitespace()).collect();
    let digits = digits.strip_prefix("0x").unwrap_or(&digits);
    let digits = digits.strip_suffix('h').unwrap_or(digits);
    match digits.len() {
        4 => u16::from_str_radix(digits, 16).ok().map(Code::Emergency),
        8 => u32::from_str_radix(digits, 16).ok().map(Code::Abort),
        _ => None,
    }
}

impl fmt::Display for Meaning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Meaning { code, detail, meaning, field, cause, remedy } = self;
        write!(f, "{code}")?;
        if let Some(detail) = detail {
            write!(f, ", first byte of the error field {detail}")?;
        }
        write!(f, ": {meaning}")?;
        let parts = [("error field", field), ("cause", cause), ("remedy", remedy)];
        for (name, text) in parts.into_iter().filter(|(_, text)| !text.is_empty()) {
            write!(f, "\n  {name:<11} {text}")?;
        }
        Ok(())
    }
}
