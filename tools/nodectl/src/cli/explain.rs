//! `nodectl explain`

use std::fmt;

use clap::Args;
use serde::Serialize;

use super::{Failure, Session};
use crate::explain::{EMERGENCIES, abort, emergencies, reason};
use crate::meaning::error_code;

/// Explains an EMCY code (four hexadecimal digits) or an SDO abort code (eight): meaning, cause and remedy.
///
/// Cause and remedy are those of the nodes of this project. A code of another device has its meaning of CiA 301.
#[derive(Debug, Args)]
pub(super) struct Explain {
    /// The code, as 8130, 8130h, 0x08000022 or "0800 0022h"; without one, all EMCY codes of the nodes of this project
    code: Option<String>,
}

/// What a code means.
#[derive(Serialize)]
struct Meaning {
    code: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    detail: Option<u8>,
    meaning: &'static str,
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
        let Some(text) = &self.code else { return Ok(EMERGENCIES.iter().map(of_row).collect()) };
        let unknown =
            || Failure::Usage(format!("{text:?} is no code that CiA 301 or a node of this project has"));
        match code(text) {
            Some(Code::Emergency(code)) => {
                let own: Vec<Meaning> = emergencies(code).map(of_row).collect();
                let class = Meaning {
                    code: format!("EMCY {code:04X}h"),
                    detail: None,
                    meaning: error_code(code),
                    cause: "",
                    remedy: "",
                };
                Ok(if own.is_empty() { vec![class] } else { own })
            }
            Some(Code::Abort(code)) => {
                let reason = reason(code).ok_or_else(unknown)?;
                let (cause, remedy) = abort(reason);
                let code = format!("SDO abort {:04X} {:04X}h", code >> 16, code & 0xFFFF);
                Ok(vec![Meaning { code, detail: None, meaning: reason.meaning(), cause, remedy }])
            }
            None => Err(unknown()),
        }
    }
}

fn of_row(row: &crate::explain::Emergency) -> Meaning {
    let code = format!("EMCY {:04X}h", row.code);
    Meaning { code, detail: row.detail, meaning: row.name, cause: row.cause, remedy: row.remedy }
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
        let Meaning { code, detail, meaning, cause, remedy } = self;
        write!(f, "{code}")?;
        if let Some(detail) = detail {
            write!(f, ", first byte of the error field {detail}")?;
        }
        write!(f, ": {meaning}")?;
        for (name, text) in
            [("cause", cause), ("remedy", remedy)].into_iter().filter(|(_, text)| !text.is_empty())
        {
            write!(f, "\n  {name:<7} {text}")?;
        }
        Ok(())
    }
}
