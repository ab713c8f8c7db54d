//! Physical units of the process value, object 6131h (codes of CiA 303-2, and codes from A0h on, which CiA leaves to
//! profiles).

use super::precise::Precise;

/// Conversion of a field value in Pa or K to a process value: `value / divisor - zero`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    divisor: f32,
    zero: f32,
}

/// Standard acceleration of gravity in m/s2, exact.
const GRAVITY: f64 = 9.806_65;
/// Largest prefix, as a positive or negative power of ten.
const MAX_PREFIX: i8 = 18;

impl Unit {
    /// bar, the default of the pressure channel.
    pub const BAR: Unit = Unit { divisor: 100_000.0, zero: 0.0 };
    /// Degree Celsius, the default of the temperature channel.
    pub const CELSIUS: Unit = Unit { divisor: 1.0, zero: 273.15 };

    /// The pressure unit with this value of 6131h:1; `None` for an unsupported unit.
    #[must_use]
    pub fn pressure(code: u32) -> Option<Unit> {
        let (unit, prefix) = split(code)?;
        let pascal = match unit {
            0x22 => const { Precise::near_double(1.0) },
            0x4E => const { Precise::near_double(100_000.0) },
            // Pound-force per square inch, of the international pound and inch.
            0xAB => const { Precise::near_double(0.453_592_37 * GRAVITY / (0.0254 * 0.0254)) },
            // Millimetre of mercury at 0 degC, 13 595.1 kg/m3.
            0xA0 => const { Precise::near_double(13.595_1 * GRAVITY) },
            // Technical atmosphere, kgf/cm2.
            0xA1 => const { Precise::near_double(10_000.0 * GRAVITY) },
            // Millimetre of water at 4 degC, 999.972 kg/m3.
            0xA2 => const { Precise::near_double(0.999_972 * GRAVITY) },
            0xA4 => const { Precise::near_double(101_325.0) },
            _ => return None,
        };
        Some(Unit::prefixed(pascal, Precise::ZERO, prefix))
    }

    /// The temperature unit with this value of 6131h:2; `None` for an unsupported unit.
    #[must_use]
    pub fn temperature(code: u32) -> Option<Unit> {
        let (unit, prefix) = split(code)?;
        let (kelvin, zero) = match unit {
            0x05 => const { (Precise::ONE, Precise::ZERO) },
            0x2D => const { (Precise::ONE, Precise::near_double(273.15)) },
            0xAC => const { (Precise::near_double(5.0 / 9.0), Precise::near_double(459.67)) },
            _ => return None,
        };
        Some(Unit::prefixed(kelvin, zero, prefix))
    }

    /// A unit with a prefix, rounded as from double precision.
    fn prefixed(divisor: Precise, zero: Precise, prefix: i8) -> Unit {
        Unit { divisor: divisor.shifted(prefix).rounded(), zero: zero.shifted(-prefix).rounded() }
    }

    /// The value of Pa or K in this unit.
    #[must_use]
    pub fn of(&self, value: f32) -> f32 {
        value / self.divisor - self.zero
    }
}

/// Unit code and prefix of a value of 6131h. Bits 0 to 15 (denominator) are not used.
fn split(code: u32) -> Option<(u8, i8)> {
    let [0, 0, unit, prefix] = code.to_le_bytes() else { return None };
    let prefix = i8::from_le_bytes([prefix]);
    (prefix.unsigned_abs() <= MAX_PREFIX.unsigned_abs()).then_some((unit, prefix))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_defaults_have_the_units_of_their_codes() {
        assert_eq!(Unit::pressure(0x004E_0000), Some(Unit::BAR));
        assert_eq!(Unit::temperature(0x002D_0000), Some(Unit::CELSIUS));
    }

    /// Every unit with every prefix is rounded as from double precision.
    #[test]
    #[allow(clippy::cast_possible_truncation)]
    fn agrees_with_double_precision() {
        let pressures = [
            (0x22, 1.0),
            (0x4E, 100_000.0),
            (0xAB, 0.453_592_37 * GRAVITY / (0.0254 * 0.0254)),
            (0xA0, 13.595_1 * GRAVITY),
            (0xA1, 10_000.0 * GRAVITY),
            (0xA2, 0.999_972 * GRAVITY),
            (0xA4, 101_325.0),
        ];
        let temperatures = [(0x05, 1.0, 0.0), (0x2D, 1.0, 273.15), (0xAC, 5.0 / 9.0, 459.67)];
        for prefix in -MAX_PREFIX..=MAX_PREFIX {
            let code = |unit| u32::from_le_bytes([0, 0, unit, prefix.to_le_bytes()[0]]);
            let power = 10_f64.powi(prefix.into());
            let rounded =
                |divisor, zero| Unit { divisor: (divisor * power) as f32, zero: (zero / power) as f32 };
            for (unit, pascal) in pressures {
                assert_eq!(Unit::pressure(code(unit)), Some(rounded(pascal, 0.0)), "{unit:X} {prefix}");
            }
            for (unit, kelvin, zero) in temperatures {
                assert_eq!(Unit::temperature(code(unit)), Some(rounded(kelvin, zero)), "{unit:X} {prefix}");
            }
        }
    }

    #[test]
    fn every_unit_follows_its_definition() {
        for (code, pascal) in [
            (0x0022_0000, 1.0),
            (0x004E_0000, 100_000.0),
            (0x00AB_0000, 6_894.757),
            (0x00A0_0000, 133.3224),
            (0x00A1_0000, 98_066.5),
            (0x00A2_0000, 9.806_375),
            (0x00A4_0000, 101_325.0),
        ] {
            let two = Unit::pressure(code).unwrap().of(2.0 * pascal);
            assert!((two - 2.0).abs() < 1e-6, "{code:08X}: {two}");
        }
        // Water freezes and boils.
        for (code, freezing, boiling) in [
            (0x0005_0000, 273.15, 373.15),
            (0x002D_0000, 0.0, 100.0),
            (0x00AC_0000, 32.0, 212.0),
            (0xFD2D_0000, 0.0, 100_000.0),
        ] {
            let unit = Unit::temperature(code).unwrap();
            let [cold, hot] = [273.15, 373.15].map(|kelvin| unit.of(kelvin));
            assert!((cold - freezing).abs() < 0.1 && (hot - boiling).abs() < 0.1, "{code:08X}: {cold} {hot}");
        }
    }

    #[test]
    fn a_prefix_divides() {
        let millibar = Unit::pressure(0xFD4E_0000).unwrap().of(101_325.0);
        let kilopascal = Unit::pressure(0x0322_0000).unwrap().of(101_325.0);
        assert_eq!(
            (millibar.to_bits(), kilopascal.to_bits()),
            (1013.25_f32.to_bits(), 101.325_f32.to_bits())
        );
    }

    #[test]
    fn units_of_the_other_channel_and_stray_bits_are_refused() {
        assert_eq!(Unit::pressure(0x002D_0000), None);
        assert_eq!(Unit::temperature(0x004E_0000), None);
        assert_eq!(Unit::pressure(0x004E_0001), None);
        assert_eq!(Unit::pressure(0x004E_0100), None);
        assert_eq!(Unit::pressure(0x1322_0000), None);
        assert_eq!(Unit::pressure(0xED22_0000), None);
        assert!(Unit::pressure(0x1222_0000).is_some() && Unit::pressure(0xEE22_0000).is_some());
        assert_eq!(Unit::pressure(0x8022_0000), None);
    }
}
