//! A CAN-ID on the command line.

/// Reads a base CAN-ID in hexadecimal digits: `181`, `0x181` or `181h`.
pub(super) fn can_id(text: &str) -> Result<u16, String> {
    let digits = text.strip_prefix("0x").or_else(|| text.strip_suffix(['h', 'H'])).unwrap_or(text);
    let is_sign = digits.starts_with('+');
    let id = u16::from_str_radix(digits, 16).ok().filter(|id| !is_sign && *id < 0x800);
    id.ok_or_else(|| format!("\"{text}\" is no CAN-ID from 0 to 7FF, such as 181"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_forms_of_one_number() {
        for text in ["181", "0x181", "181h", "181H"] {
            assert_eq!(can_id(text), Ok(0x181), "{text}");
        }
        for text in ["", "h", "0x", "0x181h", "800", "-1", "+1", "x", "181 "] {
            assert!(can_id(text).is_err(), "{text}");
        }
    }
}
