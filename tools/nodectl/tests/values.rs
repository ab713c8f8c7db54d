//! Tests of values of every type: from text to bytes and back.

use eds::{Class, DataType};
use nodectl::value::{self, Value, data_type, guess};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

fn repeatable() -> ProptestConfig {
    ProptestConfig { rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() }
}

fn types() -> impl Strategy<Value = DataType> {
    (1..=0x1B_u16).prop_map(DataType)
}

proptest! {
    #![proptest_config(repeatable())]

    /// A printed value, read again, means the same bytes.
    #[test]
    fn printed_and_read(data_type in types(), bytes in prop::collection::vec(any::<u8>(), 8..20)) {
        let value = Value::decode(&bytes, data_type);
        let read = Value::parse(&value.to_string(), data_type)?;
        // There are many NaNs, so that only being one is compared.
        let is_nan = value.as_f64().is_some_and(f64::is_nan);
        let again = Value::decode(&read.encode(data_type), data_type);
        prop_assert!(is_nan || again == value, "{data_type}: {value:?} {again:?}");
    }

    /// A value with too few bytes for its type is shown as bytes.
    #[test]
    fn too_few(data_type in types(), bytes in prop::collection::vec(any::<u8>(), 0..8)) {
        let value = Value::decode(&bytes, data_type);
        let size = match data_type.class() {
            Class::Signed(bits) | Class::Unsigned(bits) | Class::Real(bits) => usize::from(bits).div_ceil(8),
            Class::Text | Class::Bytes => 0,
        };
        prop_assert_eq!(bytes.len() < size, size > 0 && value == Value::Bytes(bytes));
    }

    /// Every integer in the range of its type is accepted, in both notations, and no integer outside of the range.
    #[test]
    fn integers_in_their_range(bits in 1..=8_u32, signed: bool, number in any::<i64>()) {
        let bits = bits * 8;
        let name = format!("{}{bits}", if signed { 'i' } else { 'u' });
        let data_type = data_type(&name).expect("a type");
        let number = i128::from(number) >> (64 - bits.min(63)) ;
        let (low, high) = if signed { (-(1_i128 << (bits - 1)), (1_i128 << (bits - 1)) - 1) } else { (0, (1_i128 << bits) - 1) };
        let hexadecimal = if number < 0 { format!("-{:#x}", -number) } else { format!("{number:#x}") };
        for text in [number.to_string(), hexadecimal] {
            let parsed = Value::parse(&text, data_type);
            prop_assert_eq!(parsed.is_ok(), (low..=high).contains(&number), "{} {}", text, name);
            if let Ok(value) = parsed {
                let bytes = value.encode(data_type);
                prop_assert_eq!(bytes.len() as u32 * 8, bits);
                prop_assert_eq!(Value::decode(&bytes, data_type), Value::Integer(number));
            }
        }
    }

    /// The parser accepts or refuses any text without a panic.
    #[test]
    fn any_text(text in ".{0,40}", data_type in types()) {
        if let Ok(value) = Value::parse(&text, data_type) {
            let _ = value.encode(data_type);
        }
        let _ = value::data_type(&text);
    }

    /// The guessed type of a value shows all of its bytes.
    #[test]
    fn a_guess_loses_nothing(bytes in prop::collection::vec(any::<u8>(), 0..20)) {
        let data_type = guess(&bytes);
        prop_assert_eq!(Value::decode(&bytes, data_type).encode(data_type), bytes);
    }
}

#[test]
fn bytes_on_the_wire() {
    for (text, name, bytes) in [
        ("-2", "i16", &[0xFE, 0xFF][..]),
        ("0x12345", "UNSIGNED24", &[0x45, 0x23, 0x01]),
        ("true", "b", &[1]),
        ("1.5", "REAL32", &[0, 0, 0xC0, 0x3F]),
        ("save", "vs", b"save"),
        ("A\u{e9}", "us", &[0x41, 0, 0xE9, 0]),
        ("DEAD be ef", "os", &[0xDE, 0xAD, 0xBE, 0xEF]),
    ] {
        let data_type = data_type(name).expect(name);
        assert_eq!(Value::parse(text, data_type).expect(text).encode(data_type), bytes, "{text}");
    }
}

#[test]
fn limits_are_part_of_the_error() {
    let message = |text, name| Value::parse(text, data_type(name).unwrap()).unwrap_err().to_string();
    assert_eq!(message("256", "u8"), "\"256\" is not a whole number from 0 to 255");
    assert_eq!(message("-32769", "i16"), "\"-32769\" is not a whole number from -32768 to 32767");
    assert_eq!(message("2", "b"), "\"2\" is not true or false");
    assert_eq!(
        message("0x1", "r32"),
        "\"0x1\" is not a number of REAL32, or its 8 hexadecimal digits after 0x"
    );
    assert_eq!(message("ABC", "d"), "\"ABC\" is not pairs of hexadecimal digits");
}

/// A number that its type does not have would become infinity or 0.
#[test]
fn a_real_number_is_checked_and_can_be_its_bits() {
    let parsed = |text, name| {
        let data_type = data_type(name).expect("a type");
        Value::parse(text, data_type).ok().map(|value| value.encode(data_type))
    };
    for (text, number) in [
        ("0x3FC00000", 1.5),
        ("0X3fc00000", 1.5),
        ("0x7F800000", f32::INFINITY),
        ("1e38", 1e38),
        ("0.0000", 0.0),
        ("-0e5", -0.0),
        ("1e-45", 1e-45),
        ("inf", f32::INFINITY),
        ("-infinity", f32::NEG_INFINITY),
    ] {
        assert_eq!(parsed(text, "r32"), Some(number.to_le_bytes().to_vec()), "{text}");
    }
    for text in [
        "1e39",
        "-1e39",
        "1e400",
        "1e-50",
        "0.5e-400",
        "0x10",
        "0x3FC000000",
        "0x+FC00000",
        "-0x3FC00000",
        "1.5 bar",
        "",
    ] {
        assert_eq!(parsed(text, "r32"), None, "{text}");
    }
    assert_eq!(parsed("0x3FF8000000000000", "r64"), Some(1.5_f64.to_le_bytes().to_vec()));
    assert_eq!(parsed("1e39", "r64"), Some(1e39_f64.to_le_bytes().to_vec()));
    for text in ["1e400", "1e-400", "0x3FC00000"] {
        assert_eq!(parsed(text, "r64"), None, "{text}");
    }
}

#[test]
fn every_type_has_its_name() {
    for code in 1..=0x1B {
        let data_type = DataType(code);
        if data_type.class() != Class::Bytes || matches!(code, 0x0A | 0x0F) {
            assert_eq!(value::data_type(&data_type.to_string()), Some(data_type));
        }
    }
    for name in ["", "u", "u7", "x32", "float", "\u{e9}32"] {
        assert_eq!(value::data_type(name), None, "{name}");
    }
}
