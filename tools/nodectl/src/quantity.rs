//! The unit and the decimal point of the number in an object.

use std::convert::Infallible;

use canopen::sdo::Multiplexer;
use eds::{Class, DataType};

use crate::Catalogue;
use crate::object::at;
use crate::sdo::{Client, Error};
use crate::text::visible;
use crate::unit::symbol;
use crate::value::{Value, ValueError};

/// The unit of a value, and the scale of its number.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Quantity {
    /// The unit; empty without a unit.
    pub unit: String,
    /// The scale; `None` where the number is the value.
    scale: Option<Scale>,
}

/// Multiplication by `factor`, with the decimal point `digits` digits from the right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Scale {
    factor: u32,
    digits: u8,
}

impl Quantity {
    /// A quantity whose number is the value.
    #[must_use]
    pub fn plain(unit: &str) -> Quantity {
        Quantity { unit: unit.to_owned(), scale: None }
    }

    /// Whether the number has to be multiplied to get the value.
    #[must_use]
    pub fn is_scaled(&self) -> bool {
        self.scale.is_some()
    }

    /// The quantity of an object, from the data sheet or from the objects of the node that the data sheet names: the
    /// unit (6131h in CiA 404) and the decimal digits beside it (6132h), or a measuring step (6384h in CiA 417).
    ///
    /// # Errors
    /// SDO errors, except where the node has no such object.
    pub fn of(client: &mut Client, catalogue: &Catalogue, of: Multiplexer) -> Result<Quantity, Error> {
        Quantity::by(catalogue, of, |at| word(client, at))
    }

    /// The quantity of an object. `word` reads the number of an object, or returns `None` where the node does not have
    /// it.
    ///
    /// # Errors
    /// The errors of `word`.
    pub fn by<E>(
        catalogue: &Catalogue,
        of: Multiplexer,
        mut word: impl FnMut(Multiplexer) -> Result<Option<u32>, E>,
    ) -> Result<Quantity, E> {
        let unit = catalogue.unit(of);
        let Some(told_by) = eds::address(unit) else { return Ok(Quantity::plain(unit)) };
        let step = catalogue.unit(told_by);
        if !step.is_empty() {
            let steps = word(told_by)?.unwrap_or(1);
            return Ok(Quantity::of_steps(steps, step));
        }
        let Some(code) = word(at(told_by.index, of.sub))? else { return Ok(Quantity::default()) };
        let digits = match digits_object(catalogue, told_by.index, of) {
            Some(object) => word(object)?.unwrap_or(0),
            None => 0,
        };
        Ok(Quantity { unit: symbol(code), scale: Scale::new(1, digits) })
    }

    /// The objects of a node that the quantity of an object depends on.
    #[must_use]
    pub(crate) fn sources(catalogue: &Catalogue, of: Multiplexer) -> Vec<Multiplexer> {
        let mut sources = Vec::new();
        let _ = Quantity::by(catalogue, of, |at| {
            sources.push(at);
            Ok::<_, Infallible>(Some(1))
        });
        sources
    }

    /// A number of steps, each of a size such as `10 um` or `0.1 mm/s`.
    fn of_steps(steps: u32, step: &str) -> Quantity {
        let (number, unit) = step.split_once(' ').unwrap_or(("1", step));
        let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
        let factor = format!("{whole}{fraction}").parse::<u32>().unwrap_or(1).saturating_mul(steps);
        let digits = u32::try_from(fraction.len()).unwrap_or(0);
        let (unit, digits) = match unit {
            "um" => ("mm", digits + 3),
            "us" => ("ms", digits + 3),
            unit => (unit, digits),
        };
        Quantity { unit: unit.to_owned(), scale: Scale::new(factor, digits) }
    }

    /// The value of a number, with the scale applied.
    #[must_use]
    pub fn apply(&self, value: Value) -> Value {
        match (self.scale, value) {
            (Some(Scale { factor, digits }), Value::Integer(number)) => {
                Value::Decimal(number.saturating_mul(factor.into()), digits)
            }
            (_, value) => value,
        }
    }

    /// The number on the wire for a value that a person has typed, in its displayed form: `2` and `2.0` are the same. A
    /// hexadecimal text is the number itself.
    ///
    /// # Errors
    /// The text is no value of this type, or no multiple of its step.
    pub fn parse(&self, text: &str, data_type: DataType) -> Result<Value, ValueError> {
        let is_bits = text.trim().trim_start_matches('-').to_ascii_lowercase().starts_with("0x");
        if self.scale.is_none() || is_bits {
            return Value::parse(text, data_type);
        }
        match self.number(text) {
            Some(number) => Value::parse(&number.to_string(), data_type),
            None => Err(ValueError::new(text, format!("a number of steps of {}", self.step()))),
        }
    }

    /// The smallest step of the value, with its unit.
    fn step(&self) -> String {
        format!("{} {}", self.apply(Value::Integer(1)), self.unit)
    }

    /// The number for a decimal text such as `2` or `2.5`; `None` for any other text, for a value between two steps, and
    /// where there is no scale.
    #[must_use]
    pub fn number(&self, text: &str) -> Option<i128> {
        let Scale { factor, digits } = self.scale?;
        let (whole, fraction) = text.trim().split_once('.').unwrap_or((text.trim(), ""));
        let missing = usize::from(digits).checked_sub(fraction.len())?;
        let all = format!("{whole}{fraction}{}", "0".repeat(missing));
        let mantissa: i128 = all.parse().ok()?;
        (mantissa % i128::from(factor) == 0).then_some(mantissa / i128::from(factor))
    }
}

impl Scale {
    /// A scale; `None` where it would change nothing. Decimal places that are always 0 are left out.
    fn new(mut factor: u32, digits: u32) -> Option<Scale> {
        let mut digits = u8::try_from(digits.min(38)).unwrap_or(38);
        while digits > 0 && factor != 0 && factor.is_multiple_of(10) {
            (factor, digits) = (factor / 10, digits - 1);
        }
        (factor != 0 && (factor, digits) != (1, 0)).then_some(Scale { factor, digits })
    }
}

/// A value with its unit, and `hexadecimal` between them. A number of steps such as `100 us` has the product behind it:
/// `100 x 100 us (10 ms)`. The number that `write` takes is in front.
#[must_use]
pub(crate) fn with_unit(value: &Value, hexadecimal: &str, unit: &str) -> String {
    let number = visible(&value.to_string());
    match (steps(value, unit), unit) {
        (Some(zero), _) if *value == Value::Integer(0) => zero,
        (Some(product), unit) => format!("{number} x {unit} ({product})"),
        (None, "") => format!("{number}{hexadecimal}"),
        (None, unit) => format!("{number}{hexadecimal} {unit}"),
    }
}

/// The product of a number and a unit such as `100 us`; `None` for any other unit, as `ms` or `1/K`.
fn steps(value: &Value, unit: &str) -> Option<String> {
    let (step, _) = unit.split_once(' ')?;
    step.parse::<f64>().ok().filter(|step| *step > 0.0)?;
    let Value::Integer(_) = value else { return None };
    let quantity = Quantity::of_steps(1, unit);
    let number = quantity.apply(value.clone()).to_string();
    let number =
        if number.contains('.') { number.trim_end_matches('0').trim_end_matches('.') } else { &number };
    Some(format!("{number} {}", quantity.unit))
}

/// The object with the decimal digits of an integer: the object beside the unit, if its name in the data sheet says so.
fn digits_object(catalogue: &Catalogue, unit: u16, of: Multiplexer) -> Option<Multiplexer> {
    let object = at(unit.checked_add(1)?, of.sub);
    let is_integer = matches!(catalogue.data_type(of)?.class(), Class::Signed(_) | Class::Unsigned(_));
    let name = catalogue.entry(object)?.name.to_lowercase();
    (is_integer && name.contains("decimal digits")).then_some(object)
}

/// A number of up to four bytes; `None` where the node refuses the object.
fn word(client: &mut Client, at: Multiplexer) -> Result<Option<u32>, Error> {
    match client.upload(at) {
        Ok(bytes) => Ok(Some(bytes.iter().take(4).rev().fold(0, |word, &byte| word << 8 | u32::from(byte)))),
        Err(error) if error.abort().is_some() => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn quantity(factor: u32, digits: u32) -> Quantity {
        Quantity { unit: "bar".to_owned(), scale: Scale::new(factor, digits) }
    }

    #[test]
    fn the_point_is_where_the_digits_say() {
        for (number, digits, text) in [
            (250, 2, "2.50"),
            (-250, 2, "-2.50"),
            (5, 2, "0.05"),
            (-5, 2, "-0.05"),
            (0, 2, "0.00"),
            (7, 0, "7"),
            (1, 38, "0.00000000000000000000000000000000000001"),
        ] {
            let value = quantity(1, digits).apply(Value::Integer(number));
            assert_eq!(value.to_string(), text);
            assert_eq!(value.as_f64(), Some(text.parse().unwrap()));
        }
        assert_eq!(quantity(1, 2).apply(Value::Real32(2.5)), Value::Real32(2.5));
    }

    #[test]
    fn steps_are_multiplied() {
        for (steps, step, number, text) in [
            (100, "10 um", 3000, "3000 mm"),
            (50, "10 um", 3, "1.5 mm"),
            (10, "0.1 mm/s", 7, "7 mm/s"),
            (1, "ms", 9, "9 ms"),
        ] {
            let quantity = Quantity::of_steps(steps, step);
            let value = quantity.apply(Value::Integer(number));
            assert_eq!(format!("{value} {}", quantity.unit), text);
        }
    }

    #[test]
    fn a_number_of_steps_is_shown_as_their_product() {
        for (number, unit, text) in [
            (100, "100 us", "100 x 100 us (10 ms)"),
            (25, "100 us", "25 x 100 us (2.5 ms)"),
            (0, "100 us", "0 ms"),
            (12345, "0.1 h", "12345 x 0.1 h (1234.5 h)"),
            (-7, "0.1 mm/s", "-7 x 0.1 mm/s (-0.7 mm/s)"),
            (1000, "ms", "1000 ms"),
            (3, "1/K", "3 1/K"),
            (3, "steps or nm", "3 steps or nm"),
            (3, "", "3"),
        ] {
            assert_eq!(with_unit(&Value::Integer(number), "", unit), text);
        }
        assert_eq!(with_unit(&Value::Integer(16), " (00000010h)", "us"), "16 (00000010h) us");
        assert_eq!(with_unit(&Value::Text("a\u{1b}".to_owned()), "", ""), "a\\x1b");
    }

    #[test]
    fn a_number_with_a_point_is_the_value() {
        let quantity = quantity(1, 2);
        for (text, number) in
            [("2.5", Some(250)), ("-0.05", Some(-5)), ("2.505", None), ("2", Some(200)), ("x.1", None)]
        {
            assert_eq!(quantity.number(text), number, "{text}");
        }
        assert_eq!(Quantity::plain("ms").number("2.0"), None);
        assert_eq!(Quantity::of_steps(50, "10 um").number("1.5"), Some(3));
        assert_eq!(Quantity::of_steps(50, "10 um").number("1.7"), None);
        let parse = |text: &str| quantity.parse(text, DataType(0x03));
        assert_eq!(parse("2"), parse("2.0"));
        assert_eq!(parse("2"), Ok(Value::Integer(200)));
        assert_eq!(parse("0x2"), Ok(Value::Integer(2)), "the number on the wire");
        let error = parse("2.505").unwrap_err().to_string();
        assert_eq!(error, "\"2.505\" is not a number of steps of 0.01 bar");
    }
}
