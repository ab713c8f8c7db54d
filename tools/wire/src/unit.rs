//! Physical units by their codes (CiA 303-2).

/// The names of units. Codes from A0h on are those that CiA 303-2 leaves to the profiles, with their meaning in CiA 404.
const NAMES: [(u8, &str); 10] = [
    (0x05, "K"),
    (0x22, "Pa"),
    (0x2D, "\u{b0}C"),
    (0x4E, "bar"),
    (0xA0, "mmHg"),
    (0xA1, "at"),
    (0xA2, "mmH2O"),
    (0xA4, "atm"),
    (0xAB, "psi"),
    (0xAC, "\u{b0}F"),
];

/// The symbol of a code: unit in bits 16 to 23, prefix as a power of ten in bits 24 to 31.
#[must_use]
pub fn symbol(code: u32) -> String {
    let [_, _, unit, prefix] = code.to_le_bytes();
    let Some((_, name)) = NAMES.iter().find(|(code, _)| *code == unit) else {
        return format!("unit {code:08X}h");
    };
    let prefix = match i8::from_le_bytes([prefix]) {
        0 => String::new(),
        -6 => "u".to_owned(),
        -3 => "m".to_owned(),
        3 => "k".to_owned(),
        6 => "M".to_owned(),
        power => format!("10^{power} "),
    };
    prefix + name
}

/// The code of a symbol, for example of `mbar`; `degC` stands for °C. `None` for any other text.
#[must_use]
pub fn code(text: &str) -> Option<u32> {
    let text = text.replace("deg", "\u{b0}");
    let codes = NAMES.iter().flat_map(|(unit, _)| {
        [0, -6, -3, 3, 6, 2].map(|power: i8| u32::from_le_bytes([0, 0, *unit, power.to_le_bytes()[0]]))
    });
    codes.into_iter().find(|code| symbol(*code) == text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn symbols_are_written_as_they_are_read() {
        for text in ["bar", "mbar", "kPa", "MPa", "psi", "K", "\u{b0}C", "10^2 Pa"] {
            assert_eq!(code(text).map(symbol).as_deref(), Some(text));
        }
        assert_eq!(code("degC"), Some(0x002D_0000));
        assert_eq!((code("bars"), code(""), code("unit 00010000h")), (None, None, None));
    }

    #[test]
    fn codes_in_symbols() {
        for (code, text) in [
            (0x004E_0000, "bar"),
            (0xFD4E_0000, "mbar"),
            (0x0322_0000, "kPa"),
            (0x002D_0000, "\u{b0}C"),
            (0x0222_0000, "10^2 Pa"),
            (0x0001_0000, "unit 00010000h"),
        ] {
            assert_eq!(symbol(code), text);
        }
    }
}
