//! Time stamps: `SECONDS.FRACTION`, as candump and socketcand write them.

/// The time stamp of an instant in microseconds.
#[must_use]
pub fn text(micros: u64) -> String {
    format!("{}.{:06}", micros / 1_000_000, micros % 1_000_000)
}

/// The microseconds of a time stamp with any number of digits. What is below a microsecond is cut off.
#[must_use]
pub fn parse(text: &str) -> Option<u64> {
    let (seconds, fraction) = text.split_once('.')?;
    let micros = format!("{fraction:0<6}").get(..6)?.parse::<u64>().ok()?;
    seconds.parse::<u64>().ok()?.checked_mul(1_000_000)?.checked_add(micros)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_time_stamp_reads_back() {
        for micros in [0, 1, 999_999, 1_000_000, 1_436_509_052_249_713, u64::MAX] {
            assert_eq!(parse(&text(micros)), Some(micros));
        }
        assert_eq!(text(12_000_001), "12.000001");
    }

    #[test]
    fn any_number_of_digits() {
        assert_eq!(parse("1.5"), Some(1_500_000));
        assert_eq!(parse("1.0000019"), Some(1_000_001));
        for text in ["", "1", "now", "1.\u{e9}", "1.x", "99999999999999999999.0"] {
            assert_eq!(parse(text), None, "{text}");
        }
    }
}
