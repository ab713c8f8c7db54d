//! Hexadecimal digits and nothing else: `from_str_radix` takes a sign, too.

use std::fmt::Write as _;

use embedded_can::{ExtendedId, Frame, Id, StandardId};

/// A number.
pub(crate) fn number(text: &str) -> Option<u32> {
    let is_plain = text.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(text, 16).ok().filter(|_| is_plain)
}

/// A base identifier.
pub(crate) fn base_id(text: &str) -> Option<Id> {
    StandardId::new(u16::try_from(number(text)?).ok()?).map(Id::Standard)
}

/// An extended identifier.
pub(crate) fn extended_id(text: &str) -> Option<Id> {
    ExtendedId::new(number(text)?).map(Id::Extended)
}

/// The digits of an identifier: three, or eight of an extended one.
pub(crate) fn of_id(id: Id) -> String {
    match id {
        Id::Standard(id) => format!("{:03X}", id.as_raw()),
        Id::Extended(id) => format!("{:08X}", id.as_raw()),
    }
}

/// A frame from an identifier and pairs of digits.
pub(crate) fn data_frame<F: Frame>(id: Id, pairs: &str) -> Option<F> {
    F::new(id, &hex::decode(pairs).ok()?)
}

/// The bytes of a data frame as pairs of digits. A remote frame has none.
pub(crate) fn of_data<F: Frame>(frame: &F, separator: &str) -> String {
    let mut text = String::new();
    for byte in frame.data().iter().filter(|_| frame.is_data_frame()) {
        let between = if text.is_empty() { "" } else { separator };
        // Writing to a string cannot fail.
        let _ = write!(text, "{between}{byte:02X}");
    }
    text
}
