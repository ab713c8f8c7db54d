//! Compile errors that name the row: `1A00h:1: the mapped object is not in the table`.
#![allow(clippy::indexing_slicing, clippy::panic, reason = "evaluated by the compiler")]

/// The longest message. A longer one is cut.
const ROOM: usize = 160;

/// A text that a constant function builds.
struct Text {
    bytes: [u8; ROOM],
    len: usize,
}

impl Text {
    /// Index and sub-index.
    const fn of(index: u16, sub: u8) -> Text {
        let mut text = Text { bytes: [0; ROOM], len: 0 };
        let mut shift = 16;
        while shift > 0 {
            shift -= 4;
            text.push(b"0123456789ABCDEF"[(index >> shift) as usize & 0xF]);
        }
        text.add("h:");
        if sub >= 100 {
            text.push(b'0' + sub / 100);
        }
        if sub >= 10 {
            text.push(b'0' + sub / 10 % 10);
        }
        text.push(b'0' + sub % 10);
        text
    }

    const fn push(&mut self, byte: u8) {
        if self.len < ROOM {
            self.bytes[self.len] = byte;
            self.len += 1;
        }
    }

    const fn add(&mut self, text: &str) {
        let mut i = 0;
        while i < text.len() {
            self.push(text.as_bytes()[i]);
            i += 1;
        }
    }
}

/// Stops the compilation with a message that begins with index and sub-index.
///
/// # Panics
/// Always.
pub(crate) const fn fail(index: u16, sub: u8, message: &str) -> ! {
    let mut text = Text::of(index, sub);
    text.add(": ");
    text.add(message);
    match core::str::from_utf8(text.bytes.split_at(text.len).0) {
        Ok(text) => panic!("{}", text),
        Err(_) => panic!("a row of the dictionary is wrong"),
    }
}

/// Stops the compilation unless the row meets the condition. A macro, because the compiler evaluates a call much
/// slower than a condition, and there are a dozen conditions for each row.
macro_rules! require {
    ($condition:expr, $row:expr, $message:expr $(,)?) => {
        if !$condition {
            $crate::dictionary::fail($row.index, $row.sub, $message);
        }
    };
}

pub(super) use require;
