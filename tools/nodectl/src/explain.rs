//! Emergency error codes and SDO abort codes of the nodes of this project: meaning, cause and remedy.
//!
//! The tables are those of docs/troubleshooting.md, which is read at compile time.

use std::sync::LazyLock;

/// The document with the tables.
const DOCUMENT: &str = include_str!("../../../docs/troubleshooting.md");

/// An emergency error code of a node of this project.
#[derive(Debug)]
pub struct Emergency {
    /// The code.
    pub code: u16,
    /// The first byte of the error field, where it tells errors of one code apart.
    pub detail: Option<u8>,
    /// The name of the error.
    pub name: String,
    /// The content of the error field.
    pub field: String,
    /// The cause.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
}

/// An abort code as a node of this project uses it.
#[derive(Debug)]
pub struct Abort {
    /// The code.
    pub code: u32,
    /// When the node sends it.
    pub cause: String,
    /// The remedy.
    pub remedy: String,
}

static EMERGENCIES: LazyLock<Vec<Emergency>> = LazyLock::new(|| {
    let rows = rows("EMCY codes").filter_map(|[code, name, field, _flag, cause, remedy]| {
        let code = u16::from_str_radix(code.strip_suffix('h')?, 16).ok()?;
        let detail = field.parse().ok();
        let field = if detail.is_some() { String::new() } else { field };
        Some(Emergency { code, detail, name, field, cause, remedy })
    });
    rows.collect()
});

static ABORTS: LazyLock<Vec<Abort>> = LazyLock::new(|| {
    let rows = rows("SDO abort codes").filter_map(|[code, _meaning, cause, remedy]| {
        let code = u32::from_str_radix(&code.strip_suffix('h')?.replace(' ', ""), 16).ok()?;
        Some(Abort { code, cause, remedy })
    });
    rows.collect()
});

/// All emergency error codes of the nodes of this project.
#[must_use]
pub fn emergencies() -> &'static [Emergency] {
    &EMERGENCIES
}

/// The row of an emergency, by its code and the first byte of its error field.
#[must_use]
pub fn emergency(code: u16, detail: u8) -> Option<&'static Emergency> {
    let fits = |row: &&Emergency| row.code == code && row.detail.is_none_or(|own| own == detail);
    EMERGENCIES.iter().find(fits)
}

/// The row of an abort code.
#[must_use]
pub fn abort(code: u32) -> Option<&'static Abort> {
    ABORTS.iter().find(|row| row.code == code)
}

/// The rows of the table below a heading of the document.
fn rows<const N: usize>(heading: &str) -> impl Iterator<Item = [String; N]> {
    let begin = format!("## {heading}");
    let lines = DOCUMENT.lines().skip_while(move |line| *line != begin).skip(1);
    let lines = lines.take_while(|line| !line.starts_with("## ")).filter(|line| line.starts_with('|'));
    lines.filter_map(|line| {
        let cells: Vec<String> = line.trim_matches('|').split('|').map(|cell| plain(cell.trim())).collect();
        cells.try_into().ok()
    })
}

/// A text without the links and the quotes of Markdown: `[wiring.md](wiring.md)` is `wiring.md`.
fn plain(cell: &str) -> String {
    let mut text = String::new();
    let mut rest = cell;
    while let Some((before, after)) = rest.split_once("](") {
        text.push_str(before);
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    text.push_str(rest);
    text.replace(['[', '`'], "")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The faults of the library and of all profiles, as the tests on the running node have them.
    const TABLE: &str = include_str!("../../../host-tests/tables/emcy.csv");

    #[test]
    fn every_emergency_that_a_node_sends_is_explained() {
        let mut sent = 0;
        for line in TABLE.lines().skip(1) {
            let cells: Vec<&str> = line.split(',').collect();
            let [code, _, _, _, _, fault, remark] = cells[..] else { panic!("{line}") };
            if fault.is_empty() {
                continue;
            }
            let code = u16::from_str_radix(&code[2..], 16).unwrap();
            let detail = remark.rsplit_once("detail is ").and_then(|(_, detail)| detail.parse().ok());
            assert!(emergency(code, detail.unwrap_or(0)).is_some_and(|row| !row.cause.is_empty()), "{line}");
            sent += 1;
        }
        assert!(sent > 25, "{sent} faults");
    }

    #[test]
    fn the_error_field_distinguishes_errors_of_one_code() {
        let names: Vec<&str> =
            (0..3).map(|detail| emergency(0x5006, detail).unwrap().name.as_str()).collect();
        assert_eq!(names, ["sensor break", "encoder does not answer", "position of the encoder is wrong"]);
        assert!(emergency(0x5006, 9).is_none() && emergency(0x4711, 0).is_none());
        assert_eq!(emergency(0x8210, 7).unwrap().field, "number of the RPDO");
    }

    #[test]
    fn every_abort_code_is_explained() {
        for reason in canopen::sdo::Abort::ALL {
            assert!(abort(reason.code()).is_some_and(|row| !row.cause.is_empty()), "{reason:?}");
        }
        assert!(abort(0x1234_5678).is_none());
    }

    #[test]
    fn links_are_left_out() {
        assert_eq!(plain("see [wiring.md](wiring.md#ssi), then `nodectl`"), "see wiring.md, then nodectl");
        assert_eq!(plain("plain"), "plain");
    }
}
