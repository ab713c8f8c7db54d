//! Values of a data sheet: numbers, text, and formulas with the node-ID.

use canopen::NodeId;
use canopen::eds::Reals;

use crate::{Class, DataType};

/// A value of any data type.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A value of an integer type or BOOLEAN.
    Integer(i128),
    /// A value of REAL32 or REAL64.
    Real(f64),
    /// A value of any other type, as the file writes it.
    Text(String),
}

/// A value that may depend on the node-ID (CiA 306, `$NODEID`).
#[derive(Clone, Debug, PartialEq)]
pub enum Formula {
    /// A value that is equal for every node-ID.
    Constant(Value),
    /// This number plus the node-ID.
    NodeId(i128),
}

impl Formula {
    /// The value for a node.
    #[must_use]
    pub fn evaluate(&self, node_id: NodeId) -> Value {
        match self {
            Formula::Constant(value) => value.clone(),
            Formula::NodeId(base) => Value::Integer(base.saturating_add(node_id.get().into())),
        }
    }

    /// Reads a value of a data type; `None` where the text is no such value.
    pub(crate) fn parse(text: &str, data_type: DataType) -> Option<Formula> {
        match data_type.class() {
            Class::Signed(bits) => integer(text, |value| signed(value, bits)),
            Class::Unsigned(bits) => integer(text, |value| unsigned(value, bits)),
            Class::Real(bits) => real(text, bits).map(|value| Formula::Constant(Value::Real(value))),
            Class::Text | Class::Bytes => Some(Formula::Constant(Value::Text(text.into()))),
        }
    }

    /// The text of a value of a data type.
    pub(crate) fn text(&self, data_type: DataType, reals: Reals) -> String {
        match (self, data_type.class()) {
            (Formula::Constant(Value::Real(value)), class)
                if reals == Reals::Decimal && value.is_finite() =>
            {
                if class == Class::Real(32) {
                    format!("{:?}", *value as f32)
                } else {
                    format!("{value:?}")
                }
            }
            (Formula::NodeId(base), _) => format!("$NODEID+0x{base:X}"),
            (Formula::Constant(Value::Text(text)), _) => text.clone(),
            (Formula::Constant(Value::Real(value)), Class::Real(32)) => bits((*value as f32).to_bits(), 8),
            (Formula::Constant(Value::Real(value)), _) => bits(value.to_bits(), 16),
            // Identifiers, mapped objects and units have all their digits, because people read them digit by digit.
            (Formula::Constant(Value::Integer(value)), Class::Unsigned(bits @ 32..)) => {
                format!("0x{value:0width$X}", width = usize::from(bits / 4))
            }
            (Formula::Constant(Value::Integer(value)), _) => value.to_string(),
        }
    }
}

/// The bits of a real number. 0 is written as `0`, which every reader understands.
fn bits(bits: impl Into<u64>, digits: usize) -> String {
    match bits.into() {
        0 => "0".to_owned(),
        bits => format!("0x{bits:0digits$X}"),
    }
}

/// A sum of numbers with `$NODEID` at most once, in any order. CiA 306 puts `$NODEID` first, vendors do not.
fn integer(text: &str, fit: impl Fn(i128) -> Option<i128>) -> Option<Formula> {
    let (mut sum, mut is_relative) = (0_i128, false);
    for term in text.split('+').map(str::trim) {
        if !term.eq_ignore_ascii_case("$NODEID") {
            sum = sum.checked_add(number(term)?)?;
        } else if std::mem::replace(&mut is_relative, true) {
            return None;
        }
    }
    let sum = fit(sum)?;
    Some(if is_relative { Formula::NodeId(sum) } else { Formula::Constant(Value::Integer(sum)) })
}

/// A number as CiA 306 writes it: hexadecimal after `0x`, octal after `0`, else decimal.
pub(crate) fn number(text: &str) -> Option<i128> {
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let lower = digits.to_ascii_lowercase();
    let (digits, radix) = match lower.strip_prefix("0x") {
        Some(digits) => (digits, 16),
        None if lower.len() > 1 && lower.starts_with('0') => (lower.as_str(), 8),
        None => (lower.as_str(), 10),
    };
    // `from_str_radix` accepts a second sign.
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_alphanumeric());
    let value = if is_plain { i128::from_str_radix(digits, radix).ok()? } else { return None };
    Some(sign * value)
}

/// The value in a text that is more than a value: the first word (`5 // off`), without the suffix of a number in C
/// (`0.0f`, `12UL`); a BOOLEAN that is not 0 is 1.
pub(crate) fn repaired<T>(text: &str, read: impl Fn(&str) -> Option<T>) -> Option<T> {
    let word = text.split_whitespace().next()?;
    let integer = word.trim_end_matches(['l', 'L', 'u', 'U']);
    let real = word.trim_end_matches(['f', 'F']);
    let is_boolean = read("1").is_some() && read("2").is_none();
    let truth = || number(integer).filter(|&value| is_boolean && value > 1).and_then(|_| read("1"));
    [word, integer, real].into_iter().find_map(&read).or_else(truth)
}

/// A number of a signed type. Vendors also write negative numbers as the unsigned number with the same bits.
fn signed(value: i128, bits: u8) -> Option<i128> {
    let half = 1_i128 << (bits - 1);
    match value {
        _ if value >= 2 * half || value < -half => None,
        _ if value >= half => Some(value - 2 * half),
        _ => Some(value),
    }
}

/// A number of an unsigned type. Vendors also write the largest number as -1.
fn unsigned(value: i128, bits: u8) -> Option<i128> {
    let end = 1_i128 << bits;
    match value {
        -1 if bits > 1 => Some(end - 1),
        _ => (0..end).contains(&value).then_some(value),
    }
}

/// The expected form of a text by its data type, with the range of an integer.
pub(crate) fn expected(data_type: DataType) -> String {
    let range = match data_type.class() {
        Class::Signed(bits) => format!(", {} to {}", -(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1),
        Class::Unsigned(bits) => format!(", 0 to {}", (1_i128 << bits) - 1),
        Class::Real(_) | Class::Text | Class::Bytes => String::new(),
    };
    format!("a value of {data_type}{range}")
}

/// A real number: a decimal number, or the bits after `0x`.
fn real(text: &str, bits: u8) -> Option<f64> {
    if !text.to_ascii_lowercase().starts_with("0x") {
        // Each width needs its own parser, so that the number is rounded once.
        return if bits == 32 { text.parse::<f32>().ok().map(f64::from) } else { text.parse().ok() };
    }
    let value = number(text)?;
    match bits {
        32 => u32::try_from(value).ok().map(|bits| f32::from_bits(bits).into()),
        _ => u64::try_from(value).ok().map(f64::from_bits),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNSIGNED32: DataType = DataType(7);
    const INTEGER8: DataType = DataType(2);
    const REAL32: DataType = DataType(8);

    fn constant(value: i128) -> Option<Formula> {
        Some(Formula::Constant(Value::Integer(value)))
    }

    #[test]
    fn a_formula_counts_from_the_node_id_in_every_spelling() {
        for text in
            ["$NODEID+0x180", "0x180+$NODEID", " $nodeid + 0x180", "384+$NodeId", "0x100+$NODEID+0x80"]
        {
            let formula = Formula::parse(text, UNSIGNED32).expect(text);
            assert_eq!(formula.evaluate(NodeId::new(5).unwrap()), Value::Integer(0x185), "{text}");
        }
        assert_eq!(Formula::parse("$NODEID", UNSIGNED32), Some(Formula::NodeId(0)));
        for text in ["$NODEID+", "$NODEID+$NODEID", "$NODE+1", "0x180-$NODEID", "", "+"] {
            assert_eq!(Formula::parse(text, UNSIGNED32), None, "{text}");
        }
    }

    #[test]
    fn numbers_are_hexadecimal_octal_or_decimal() {
        for (text, value) in [("0x1f", 31), ("0X1F", 31), ("017", 15), ("17", 17), ("0", 0), ("-5", -5)] {
            assert_eq!(number(text), Some(value), "{text}");
        }
        for text in ["", "-", "0x", "08", "--1", "1 2", "0x-1", "0x+1", "1.5", "ff"] {
            assert_eq!(number(text), None, "{text}");
        }
        assert_eq!(number(&format!("0x{}", "f".repeat(40))), None);
    }

    #[test]
    fn an_integer_fits_its_type() {
        for (text, data_type, value) in
            [("0xFF", INTEGER8, -1), ("-128", INTEGER8, -128), ("-1", UNSIGNED32, 0xFFFF_FFFF)]
        {
            assert_eq!(Formula::parse(text, data_type), constant(value), "{text}");
        }
        for (text, data_type) in [
            ("256", INTEGER8),
            ("-129", INTEGER8),
            ("0x100000000", UNSIGNED32),
            ("-2", UNSIGNED32),
            ("-5", DataType(6)),
        ] {
            assert_eq!(Formula::parse(text, data_type), None, "{text}");
        }
    }

    #[test]
    fn a_real_is_a_number_or_its_bits() {
        for (text, value) in
            [("0.1", f64::from(0.1_f32)), ("-40", -40.0), ("1e3", 1000.0), ("0x3F800000", 1.0)]
        {
            assert_eq!(Formula::parse(text, REAL32), Some(Formula::Constant(Value::Real(value))), "{text}");
        }
        assert_eq!(Formula::parse("0,5", REAL32), None);
    }

    #[test]
    fn written_values_read_back() {
        for (text, data_type) in [
            ("$NODEID+0x180", UNSIGNED32),
            ("0x004E0000", UNSIGNED32),
            ("0x0000000000000001", DataType(0x1B)),
            ("-7", INTEGER8),
            ("0x3DCCCCCD", REAL32),
            ("0x7E967699", REAL32),
            ("0xC2200000", REAL32),
            ("0", REAL32),
            ("0x80000000", REAL32),
            ("0x3FB999999999999A", DataType(0x11)),
        ] {
            assert_eq!(Formula::parse(text, data_type).unwrap().text(data_type, Reals::Bits), text);
        }
        // Vendors write real numbers with a point.
        for (text, written) in
            [("0.1", "0x3DCCCCCD"), ("1e38", "0x7E967699"), ("-40.0", "0xC2200000"), ("0.0", "0")]
        {
            assert_eq!(Formula::parse(text, REAL32).unwrap().text(REAL32, Reals::Bits), written);
            let decimal = Formula::parse(text, REAL32).unwrap().text(REAL32, Reals::Decimal);
            assert_eq!(Formula::parse(&decimal, REAL32), Formula::parse(text, REAL32), "{text}");
        }
    }
}
