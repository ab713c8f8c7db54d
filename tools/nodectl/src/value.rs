//! Values of objects: from bytes to text and back, by data type.

use std::fmt;

use eds::{Class, DataType};
use serde::{Serialize, Serializer};
use thiserror::Error;

use crate::text::hex_digits;

const UNICODE_STRING: DataType = DataType(0x0B);
const VISIBLE_STRING: DataType = DataType(0x09);

/// A value of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A value of an integer type or BOOLEAN.
    Integer(i128),
    /// A value of REAL32.
    Real32(f32),
    /// A value of REAL64.
    Real64(f64),
    /// An integer with the decimal point this number of digits from the right: the scaled value of an object. On the
    /// wire there is only the integer.
    Decimal(i128, u8),
    /// A value of a string type.
    Text(String),
    /// A value of any other type, or bytes that do not fit their type.
    Bytes(Vec<u8>),
}

/// A text that is no value of its type.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("\"{text}\" is not {expected}")]
pub struct ValueError {
    text: String,
    expected: String,
}

impl ValueError {
    pub(crate) fn new(text: &str, expected: String) -> ValueError {
        ValueError { text: text.to_owned(), expected }
    }
}

impl Value {
    /// The value in these bytes. Surplus bytes are cut off; too few bytes for the type stay bytes.
    #[must_use]
    pub fn decode(bytes: &[u8], data_type: DataType) -> Value {
        let number = |class| decode_number(bytes, class).unwrap_or_else(|| Value::Bytes(bytes.to_vec()));
        match data_type.class() {
            Class::Text if data_type == UNICODE_STRING => Value::Text(decode_utf16(bytes)),
            Class::Text => Value::Text(text(bytes)),
            Class::Bytes => Value::Bytes(bytes.to_vec()),
            class => number(class),
        }
    }

    /// Reads a value of a data type.
    ///
    /// Integers are decimal, or hexadecimal after `0x`; a real number can be its bits, all digits after `0x`. Bytes are pairs of hexadecimal digits, with or without spaces.
    /// Integers of more than 32 bits can also be written as their bytes in the order of the wire, with spaces, because
    /// profiles use them for structures.
    ///
    /// # Errors
    /// The text is no value of the type, or the value is out of the range of the type.
    pub fn parse(text: &str, data_type: DataType) -> Result<Value, ValueError> {
        let value = match data_type.class() {
            Class::Signed(bits) => integer(text, -(1 << (bits - 1)), (1 << (bits - 1)) - 1),
            Class::Unsigned(1) => boolean(text),
            Class::Unsigned(bits @ 33..) => structure(text, bits),
            Class::Unsigned(bits) => integer(text, 0, (1 << bits) - 1),
            Class::Real(bits) => real(text.trim(), bits),
            Class::Text => Some(Value::Text(text.to_owned())),
            Class::Bytes => hex_bytes(text).map(Value::Bytes),
        };
        value.ok_or_else(|| ValueError { text: text.to_owned(), expected: expected(data_type) })
    }

    /// The bytes of the value for a data type. The value must be of this type; [`parse`](Value::parse) makes no others.
    #[must_use]
    pub fn encode(&self, data_type: DataType) -> Vec<u8> {
        match self {
            Value::Integer(value) | Value::Decimal(value, _) => {
                value.to_le_bytes()[..size(data_type.class())].to_vec()
            }
            Value::Real32(value) => value.to_le_bytes().to_vec(),
            Value::Real64(value) => value.to_le_bytes().to_vec(),
            Value::Text(text) if data_type == UNICODE_STRING => {
                text.encode_utf16().flat_map(u16::to_le_bytes).collect()
            }
            Value::Text(text) => text.as_bytes().to_vec(),
            Value::Bytes(bytes) => bytes.clone(),
        }
    }

    /// The value as a number, for plots. `None` for texts and bytes.
    #[must_use]
    pub fn as_f64(&self) -> Option<f64> {
        match self {
            #[allow(clippy::cast_precision_loss)] // A plot has fewer points than f64 has digits.
            Value::Integer(value) => Some(*value as f64),
            Value::Real32(value) => Some(f64::from(*value)),
            Value::Real64(value) => Some(*value),
            // The text is exact, so that parsing it rounds only once.
            Value::Decimal(..) => self.to_string().parse().ok(),
            Value::Text(_) | Value::Bytes(_) => None,
        }
    }
}

/// The size of a number in bytes.
fn size(class: Class) -> usize {
    match class {
        Class::Signed(bits) | Class::Unsigned(bits) | Class::Real(bits) => usize::from(bits).div_ceil(8),
        Class::Text | Class::Bytes => 0,
    }
}

fn decode_number(bytes: &[u8], class: Class) -> Option<Value> {
    let bytes = bytes.get(..size(class))?;
    match class {
        Class::Real(32) => Some(Value::Real32(f32::from_le_bytes(bytes.try_into().ok()?))),
        Class::Real(_) => Some(Value::Real64(f64::from_le_bytes(bytes.try_into().ok()?))),
        Class::Unsigned(1) => Some(Value::Integer((bytes != [0]).into())),
        Class::Signed(_) => Some(Value::Integer(extend(bytes, bytes.last()? & 0x80 != 0))),
        _ => Some(Value::Integer(extend(bytes, false))),
    }
}

/// A little-endian integer of up to 16 bytes.
fn extend(bytes: &[u8], is_negative: bool) -> i128 {
    let mut word = [if is_negative { 0xFF } else { 0 }; 16];
    word[..bytes.len()].copy_from_slice(bytes);
    i128::from_le_bytes(word)
}

/// The text of a `VISIBLE_STRING`. Some devices pad texts with zeros.
#[must_use]
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned()
}

fn decode_utf16(bytes: &[u8]) -> String {
    let units: Vec<u16> = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
    String::from_utf16_lossy(&units).trim_end_matches('\0').to_owned()
}

/// A number of at most 32 bits, decimal, or hexadecimal after 0x.
#[must_use]
pub fn unsigned(text: &str) -> Option<u32> {
    match integer(text, 0, u32::MAX.into())? {
        Value::Integer(value) => u32::try_from(value).ok(),
        _ => None,
    }
}

fn boolean(text: &str) -> Option<Value> {
    match text.trim() {
        "true" | "1" => Some(Value::Integer(1)),
        "false" | "0" => Some(Value::Integer(0)),
        _ => None,
    }
}

fn integer(text: &str, low: i128, high: i128) -> Option<Value> {
    let text = text.trim();
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |digits| (-1, digits));
    let lower = digits.to_ascii_lowercase();
    let (digits, radix) = lower.strip_prefix("0x").map_or((lower.as_str(), 10), |digits| (digits, 16));
    // `from_str_radix` accepts a second sign.
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    let value = i128::from_str_radix(digits, radix).ok().filter(|_| is_plain)?.checked_mul(sign)?;
    (low..=high).contains(&value).then_some(Value::Integer(value))
}

/// A number with a fraction, or its bits: all digits after 0x. A number that the type does not have, which would become
/// infinity or 0, is refused.
fn real(text: &str, bits: u8) -> Option<Value> {
    let lower = text.to_ascii_lowercase();
    if let Some(digits) = lower.strip_prefix("0x") {
        let is_whole = digits.len() == usize::from(bits / 4) && !digits.starts_with('+');
        let pattern = u64::from_str_radix(digits, 16).ok().filter(|_| is_whole)?;
        return Some(match bits {
            32 => Value::Real32(f32::from_bits(u32::try_from(pattern).ok()?)),
            _ => Value::Real64(f64::from_bits(pattern)),
        });
    }
    let value =
        if bits == 32 { Value::Real32(text.parse().ok()?) } else { Value::Real64(text.parse().ok()?) };
    let number = value.as_f64()?;
    // `inf` and `nan` have an n.
    let is_named = lower.contains('n');
    let mantissa = lower.split('e').next().unwrap_or_default();
    let is_zero = !mantissa.bytes().any(|byte| matches!(byte, b'1'..=b'9'));
    let fits = number.is_finite() && (number != 0.0 || is_zero);
    (is_named || fits).then_some(value)
}

/// An integer of more than 32 bits: a number, or bytes with spaces. Digits with a leading zero are neither: they look
/// like bytes, and would be a decimal number.
fn structure(text: &str, bits: u8) -> Option<Value> {
    let text = text.trim();
    if text.contains(' ') {
        let bytes = hex_bytes(text).filter(|bytes| bytes.len() == usize::from(bits).div_ceil(8))?;
        return Some(Value::Integer(extend(&bytes, false)));
    }
    let is_unclear = text.len() > 1 && text.starts_with('0') && !text.to_ascii_lowercase().starts_with("0x");
    if is_unclear { None } else { integer(text, 0, (1 << bits) - 1) }
}

/// Pairs of hexadecimal digits, with or without spaces.
pub(crate) fn hex_bytes(text: &str) -> Option<Vec<u8>> {
    hex::decode(text.split_ascii_whitespace().collect::<String>()).ok()
}

fn expected(data_type: DataType) -> String {
    match data_type.class() {
        Class::Signed(bits) => {
            format!("a whole number from {} to {}", -(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1)
        }
        Class::Unsigned(1) => "true or false".to_owned(),
        Class::Unsigned(bits @ 33..) => format!(
            "a whole number from 0 to {}, or {} bytes with spaces between them",
            (1_i128 << bits) - 1,
            usize::from(bits).div_ceil(8)
        ),
        Class::Unsigned(bits) => format!("a whole number from 0 to {}", (1_i128 << bits) - 1),
        Class::Real(bits) => {
            format!("a number of {data_type}, or its {} hexadecimal digits after 0x", bits / 4)
        }
        Class::Text => "text".to_owned(),
        Class::Bytes => "pairs of hexadecimal digits".to_owned(),
    }
}

/// The data type of a name, in any case: `UNSIGNED32` as in CiA 301, or `u32`, `i16`, `r32`, `r64`, `b`, `vs`, `os`,
/// `us`, `d` as in CiA 309.
#[must_use]
pub fn data_type(name: &str) -> Option<DataType> {
    let upper = name.to_ascii_uppercase();
    let long = match (upper.as_str(), upper.get(1..)) {
        ("B", _) => "BOOLEAN".to_owned(),
        ("VS", _) => "VISIBLE_STRING".to_owned(),
        ("OS", _) => "OCTET_STRING".to_owned(),
        ("US", _) => "UNICODE_STRING".to_owned(),
        ("D", _) => "DOMAIN".to_owned(),
        (text, Some(bits)) if bits.parse::<u8>().is_ok() => match &text[..1] {
            "U" => format!("UNSIGNED{bits}"),
            "I" => format!("INTEGER{bits}"),
            "R" => format!("REAL{bits}"),
            _ => return None,
        },
        _ => upper,
    };
    (0..=0x1F).map(DataType).find(|data_type| data_type.to_string() == long)
}

/// The probable type of a value of unknown type: text if it is longer than any number, a number of a usual size, else
/// bytes.
#[must_use]
pub fn guess(bytes: &[u8]) -> DataType {
    let is_text = bytes.iter().all(|byte| byte.is_ascii_graphic() || *byte == b' ');
    match bytes.len() {
        1 => DataType(0x05),
        2 => DataType(0x06),
        4 => DataType(0x07),
        5.. if is_text => VISIBLE_STRING,
        8 => DataType(0x1B),
        _ => DataType::DOMAIN,
    }
}

/// A number with the decimal point this number of digits from the right.
fn decimal(mantissa: i128, digits: usize) -> String {
    if digits == 0 {
        return mantissa.to_string();
    }
    let sign = if mantissa < 0 { "-" } else { "" };
    let all = format!("{:0>width$}", mantissa.unsigned_abs(), width = digits + 1);
    let (whole, fraction) = all.split_at(all.len() - digits);
    format!("{sign}{whole}.{fraction}")
}

/// Numbers are decimal, bytes are hexadecimal, and a text is unchanged. For a terminal,
/// [`visible`](crate::text::visible) makes the text safe.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Integer(value) => f.pad(&value.to_string()),
            Value::Real32(value) => f.pad(&value.to_string()),
            Value::Real64(value) => f.pad(&value.to_string()),
            Value::Decimal(mantissa, digits) => f.pad(&decimal(*mantissa, (*digits).into())),
            Value::Text(text) => f.pad(text),
            Value::Bytes(bytes) => f.pad(&hex_digits(bytes, " ")),
        }
    }
}

/// A JSON number or text; bytes become hexadecimal text. Infinity and NaN become null, because JSON does not have them.
impl Serialize for Value {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Value::Integer(value) => serializer.serialize_i128(*value),
            // As an f32, because its shortest text is the number that a person expects.
            Value::Real32(value) => serializer.serialize_f32(*value),
            Value::Real64(value) => serializer.serialize_f64(*value),
            Value::Decimal(..) => serializer.serialize_f64(self.as_f64().unwrap_or(f64::NAN)),
            Value::Text(text) => serializer.serialize_str(text),
            Value::Bytes(_) => serializer.collect_str(self),
        }
    }
}
