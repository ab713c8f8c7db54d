//! Work area supervision: objects 6400h, 6401h and 6402h.

/// The work area of one channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Area {
    /// Work area low limit (6401h).
    pub low: i32,
    /// Work area high limit (6402h).
    pub high: i32,
    /// Lowest position the manufacturer allows (650Ah:2).
    pub manufacturer_low: i32,
    /// Highest position the manufacturer allows (650Ah:3).
    pub manufacturer_high: i32,
}

/// The area state register (6400h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AreaState(pub u8);

impl AreaState {
    /// Bit 0: outside of the manufacturer's limits.
    pub const OUT_OF_RANGE: u8 = 1 << 0;
    /// Bit 1: above the work area.
    pub const OVERFLOW: u8 = 1 << 1;
    /// Bit 2: below the work area.
    pub const UNDERFLOW: u8 = 1 << 2;
}

impl Area {
    /// The state at a position. Limits belong to the area; only what is beyond them is reported.
    #[must_use]
    pub fn state(&self, position: u32) -> AreaState {
        let position = i64::from(position);
        let outside =
            position < i64::from(self.manufacturer_low) || position > i64::from(self.manufacturer_high);
        let bit = |set: bool, mask: u8| if set { mask } else { 0 };
        AreaState(
            bit(outside, AreaState::OUT_OF_RANGE)
                | bit(position > i64::from(self.high), AreaState::OVERFLOW)
                | bit(position < i64::from(self.low), AreaState::UNDERFLOW),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_beyond_a_limit_is_reported() {
        let area = Area { low: 100, high: 200, manufacturer_low: 50, manufacturer_high: 250 };
        let expected = [
            (49, AreaState::OUT_OF_RANGE | AreaState::UNDERFLOW),
            (50, AreaState::UNDERFLOW),
            (99, AreaState::UNDERFLOW),
            (100, 0),
            (200, 0),
            (201, AreaState::OVERFLOW),
            (250, AreaState::OVERFLOW),
            (251, AreaState::OUT_OF_RANGE | AreaState::OVERFLOW),
        ];
        for (position, state) in expected {
            assert_eq!(area.state(position), AreaState(state), "at {position}");
        }
    }

    #[test]
    fn the_upper_half_of_the_position_is_above_every_limit() {
        let area = Area { low: 0, high: i32::MAX, manufacturer_low: 0, manufacturer_high: i32::MAX };
        assert_eq!(area.state(u32::MAX), AreaState(AreaState::OUT_OF_RANGE | AreaState::OVERFLOW));
    }
}
