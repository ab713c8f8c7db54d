//! Makes text from a device, a file or a network safe for a terminal.

use std::fmt::Write as _;

/// The text with its control characters made visible: `\n`, `\x1b`. Characters that change the text direction or are
/// invisible count as control characters, too. A terminal obeys such characters, and a line break would fake a line.
#[must_use]
pub fn visible(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for char in text.chars() {
        match char {
            '\n' => out.push_str("\\n"),
            '\r' => out.push_str("\\r"),
            '\t' => out.push_str("\\t"),
            _ if is_control(char) => {
                let code = u32::from(char);
                // Writing to a string cannot fail.
                let _ =
                    if code < 0x100 { write!(out, "\\x{code:02x}") } else { write!(out, "\\u{{{code:x}}}") };
            }
            _ => out.push(char),
        }
    }
    out
}

/// Makes control characters visible in a text of several lines of our own. The line breaks stay.
#[must_use]
pub fn visible_lines(text: &str) -> String {
    let lines: Vec<String> = text.split('\n').map(visible).collect();
    lines.join("\n")
}

/// Writes a line of our own to the standard error output. A closed output is no error: `eprintln!` would panic.
pub(crate) fn note(text: impl std::fmt::Display) {
    use std::io::Write as _;
    let _ = writeln!(std::io::stderr(), "{text}");
}

/// Bytes as pairs of hexadecimal digits.
#[must_use]
pub fn hex_digits(bytes: &[u8], separator: &str) -> String {
    let mut out = String::with_capacity(bytes.len() * (2 + separator.len()));
    for (number, byte) in bytes.iter().enumerate() {
        let separator = if number == 0 { "" } else { separator };
        let _ = write!(out, "{separator}{byte:02X}");
    }
    out
}

/// A number with the word for one or for several: `1 node is`, `2 nodes are`.
pub(crate) fn counted(count: usize, one: &str, several: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { several })
}

fn is_control(char: char) -> bool {
    let hides = matches!(u32::from(char), 0x200B..=0x200F | 0x2028..=0x202E | 0x2060..=0x206F | 0xFEFF);
    char.is_control() || hides
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn control_characters_become_visible_and_nothing_else_changes() {
        for (text, expected) in [
            ("20 \u{b0}C, \"caf\u{e9}\"", "20 \u{b0}C, \"caf\u{e9}\""),
            ("\u{1b}[2J\u{1b}]0;owned\u{7}", "\\x1b[2J\\x1b]0;owned\\x07"),
            ("a\r\nnode 2: ok\t\u{7f}", "a\\r\\nnode 2: ok\\t\\x7f"),
            ("\u{9b}31m\u{202e}txt", "\\x9b31m\\u{202e}txt"),
        ] {
            assert_eq!(visible(text), expected);
        }
        assert_eq!(visible_lines("one\ntwo\u{1b}"), "one\ntwo\\x1b");
    }
}
