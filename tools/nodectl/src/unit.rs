//! Physical units by their codes (CiA 303-2).

/// The symbol of a code: unit in bits 16 to 23, prefix as a power of ten in bits 24 to 31.
#[must_use]
pub fn symbol(code: u32) -> String {
    let [_, _, unit, prefix] = code.to_le_bytes();
    let name = match unit {
        0x05 => "K",
        0x22 => "Pa",
        0x2D => "\u{b0}C",
        0x4E => "bar",
        // Codes that CiA 303-2 leaves to the profiles, with their meaning in CiA 404.
        0xA0 => "mmHg",
        0xA1 => "at",
        0xA2 => "mmH2O",
        0xA4 => "atm",
        0xAB => "psi",
        0xAC => "\u{b0}F",
        _ => return format!("unit {code:08X}h"),
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

#[cfg(test)]
mod tests {
    use super::*;

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
