//! Work area supervision: objects 6400h, 6401h, 6402h and 650Ah.

/// The area state register (6400h): at one of the manufacturer's limits or beyond.
pub const OUT_OF_RANGE: u8 = 1 << 0;
/// The area state register (6400h): above the work area.
pub const OVERFLOW: u8 = 1 << 1;
/// The area state register (6400h): below the work area.
pub const UNDERFLOW: u8 = 1 << 2;

/// The work area of one channel, in position values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Work area low limit (6401h).
    pub low: i32,
    /// Work area high limit (6402h).
    pub high: i32,
}

/// Manufacturer's data of the sensor (650Ah), in the steps of the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Module {
    /// Distance from the zero of the sensor to the zero of the encoder (650Ah:1).
    pub offset: i32,
    /// Lowest position (650Ah:2).
    pub low: i32,
    /// Highest position (650Ah:3).
    pub high: i32,
}

impl Default for Module {
    /// No limits.
    fn default() -> Module {
        Module { offset: 0, low: i32::MIN, high: i32::MAX }
    }
}

/// The area state register at a position value, which repeats after `range`, and a position in native steps.
///
/// The limits of the work area are part of the work area: only positions beyond a limit are reported (CiA 406, 7.4.1).
/// A limit of the manufacturer is reported as soon as the position reaches it. The limits are signed and 6004h is not,
/// so both are compared in 64 bits. A limit at either end of INTEGER32 counts as no limit.
#[must_use]
#[inline]
pub fn area_state(area: &Area, module: &Module, position: u32, range: i64, native: i64) -> u8 {
    let position = i64::from(position);
    let position = if area.low < 0 { seen_from(*area, position, range) } else { position };
    let is_low = module.low > i32::MIN && native <= module.low.into();
    let is_high = module.high < i32::MAX && native >= module.high.into();
    let bit = |set: bool, mask: u8| if set { mask } else { 0 };
    bit(is_low || is_high, OUT_OF_RANGE)
        | bit(position > area.high.into(), OVERFLOW)
        | bit(position < area.low.into(), UNDERFLOW)
}

/// The position below zero of which this one is the same, where that is nearer to a work area that begins below zero.
#[inline(never)]
fn seen_from(area: Area, position: i64, range: i64) -> i64 {
    let (low, high) = (i64::from(area.low), i64::from(area.high));
    let below = position - range;
    if position > high && (below >= low || low - below < position - high) { below } else { position }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHOLE: i64 = 1 << 32;
    const AREA: Area = Area { low: 100, high: 200 };

    #[test]
    fn a_limit_of_the_sensor_is_reported_at_the_limit_and_one_of_the_area_beyond() {
        let module = Module { offset: 0, low: -50, high: 50 };
        for (position, native, state) in [
            (99, 0, UNDERFLOW),
            (100, 0, 0),
            (200, 0, 0),
            (201, 0, OVERFLOW),
            (150, -49, 0),
            (150, -50, OUT_OF_RANGE),
            (150, 49, 0),
            (150, 50, OUT_OF_RANGE),
            (150, i64::MIN, OUT_OF_RANGE),
            (u32::MAX, i64::MAX, OUT_OF_RANGE | OVERFLOW),
        ] {
            assert_eq!(area_state(&AREA, &module, position, WHOLE, native), state, "at {position}, {native}");
        }
    }

    #[test]
    fn a_module_without_limits_is_never_out_of_range() {
        for native in [i64::MIN, 0, i64::MAX] {
            assert_eq!(area_state(&AREA, &Module::default(), 150, WHOLE, native), 0);
        }
    }

    #[test]
    fn limits_in_the_wrong_order_are_both_exceeded_in_between() {
        let area = Area { low: 200, high: 100 };
        assert_eq!(area_state(&area, &Module::default(), 150, WHOLE, 0), OVERFLOW | UNDERFLOW);
    }

    #[test]
    fn a_work_area_can_begin_below_zero() {
        let (area, module) = (Area { low: -100, high: 200 }, Module::default());
        for (position, state) in [
            (0, 0),
            (200, 0),
            (201, OVERFLOW),
            (18_000, OVERFLOW),
            (19_000, UNDERFLOW),
            (35_899, UNDERFLOW),
            (35_900, 0),
        ] {
            assert_eq!(area_state(&area, &module, position, 36_000, 0), state, "{position}");
        }
    }
}
