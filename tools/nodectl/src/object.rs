//! How an object is named: by index and sub-index.

use std::fmt;

use canopen::sdo::Multiplexer;

/// Index and sub-index as CiA writes them: `1018h:1`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place(pub Multiplexer);

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.pad(&format!("{:04X}h:{}", self.0.index, self.0.sub))
    }
}

/// Index and sub-index.
#[must_use]
pub const fn at(index: u16, sub: u8) -> Multiplexer {
    Multiplexer { index, sub }
}

/// Reads an index with or without a sub-index, which is 0 where it is left out. `None` for anything else.
///
/// The index is hexadecimal in every spelling; the sub-index is decimal, or hexadecimal after `0x` or before `h`:
/// `1018:1`, `1018h:1`, `0x1018:0x01`, `0x1018sub1` (as an EDS has its sections), `1018sub0A`.
#[must_use]
pub fn parse(text: &str) -> Option<Multiplexer> {
    let lower = text.trim().to_ascii_lowercase();
    // In a section name of an EDS the sub-index is hexadecimal, too (CiA 306).
    if let Some((index, sub)) = lower.split_once("sub") {
        return Some(at(hex(index)?, u8::try_from(hex(sub)?).ok()?));
    }
    let (index, sub) = lower.split_once(':').unwrap_or((&lower, "0"));
    Some(at(hex(index)?, number(sub)?))
}

fn number(text: &str) -> Option<u8> {
    if text.starts_with("0x") || text.ends_with('h') {
        return u8::try_from(hex(text)?).ok();
    }
    let is_plain = text.bytes().all(|byte| byte.is_ascii_digit());
    is_plain.then(|| text.parse().ok())?
}

/// Up to four hexadecimal digits, after `0x` or before `h` or bare.
fn hex(text: &str) -> Option<u16> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_suffix('h')).unwrap_or(text);
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_plain.then(|| u16::from_str_radix(digits, 16).ok())?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_spelling() {
        for text in ["1018:1", "1018h:1", "0x1018:0x01", "0x1018sub1", "1018sub1", " 1018H:01 ", "1018:1h"] {
            assert_eq!(parse(text), Some(at(0x1018, 1)), "{text}");
        }
        for (text, sub) in
            [("1003:10", 10), ("1003:0x10", 16), ("1003sub10", 16), ("1003:10h", 16), ("1003", 0)]
        {
            assert_eq!(parse(text), Some(at(0x1003, sub)), "{text}");
        }
    }

    #[test]
    fn anything_else_may_be_a_name() {
        for text in [
            "", ":", "1018:", ":1", "10180:1", "1018:256", "1018:1:1", "0x", "+1018", "1018:+1", "speed",
            "sub",
        ] {
            assert_eq!(parse(text), None, "{text}");
        }
    }

    #[test]
    fn written_as_cia_does() {
        assert_eq!(Place(at(0x1018, 1)).to_string(), "1018h:1");
        assert_eq!(format!("{:<9}|", Place(at(0x6130, 2))), "6130h:2  |");
    }
}
