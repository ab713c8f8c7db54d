//! Electronic cams: objects 6300h to 6337h, eight a channel.

/// One cam of one channel.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cam {
    /// Low limit (6310h to 6317h).
    pub low: i32,
    /// High limit (6320h to 6327h).
    pub high: i32,
    /// Hysteresis (6330h to 6337h), in measuring units.
    pub hysteresis: u16,
}

impl Cam {
    /// Whether the cam is active at `position`, when it was `before` (or nobody knows).
    ///
    /// Active from the low to the high limit, both included; once active until the position is further outside
    /// than the hysteresis. Limits in the wrong order are taken in the right one (CiA 406 is silent). The limits
    /// are signed and the position is not, so both are compared in 64 bits.
    #[must_use]
    pub fn active(&self, position: u32, before: Option<bool>) -> bool {
        let margin = if before == Some(true) { i64::from(self.hysteresis) } else { 0 };
        let low = i64::from(self.low.min(self.high)) - margin;
        let high = i64::from(self.low.max(self.high)) + margin;
        (low..=high).contains(&i64::from(position))
    }
}

/// Which cams of a channel work, and how they show.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CamControl {
    /// Cam enable (6301h): bit n - 1 for cam n.
    pub enable: u8,
    /// Cam polarity (6302h): a set bit shows an active cam as 0.
    pub polarity: u8,
}

/// The cams of one channel with what hysteresis must remember.
#[derive(Clone, Debug, Default)]
pub struct CamChannel {
    active: u8,
    known: u8,
}

impl CamChannel {
    /// The cam state register (6300h) at `position`.
    ///
    /// A cam that is not enabled reads 0 whatever its polarity (6301h: its calculation is off) and forgets its
    /// state, so after enabling the window alone decides.
    pub fn update(&mut self, cams: &[Cam; 8], control: CamControl, position: u32) -> u8 {
        self.known &= control.enable;
        let mut active = 0;
        for (cam, bit) in cams.iter().zip((0..8).map(|n| 1_u8 << n)) {
            let before = (self.known & bit != 0).then_some(self.active & bit != 0);
            if control.enable & bit != 0 && cam.active(position, before) {
                active |= bit;
            }
        }
        self.active = active;
        self.known = control.enable;
        (active ^ control.polarity) & control.enable
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    prop_compose! {
        fn any_cam()(low in -50..150_i32, high in -50..150_i32, hysteresis in 0..20_u16) -> Cam {
            Cam { low, high, hysteresis }
        }
    }

    /// The rule again, by walking: a cam goes on inside its window and goes off beyond the margin.
    fn walk(cam: Cam, positions: &[u32]) -> Vec<bool> {
        let (low, high) = (i64::from(cam.low.min(cam.high)), i64::from(cam.low.max(cam.high)));
        let margin = i64::from(cam.hysteresis);
        let mut on = false;
        let mut states = Vec::new();
        for position in positions.iter().map(|p| i64::from(*p)) {
            if position >= low && position <= high {
                on = true;
            } else if position < low - margin || position > high + margin {
                on = false;
            }
            states.push(on);
        }
        states
    }

    proptest! {
        #[test]
        fn agrees_with_a_walk(cam in any_cam(), positions in prop::collection::vec(0..200_u32, 1..60)) {
            let mut channel = CamChannel::default();
            let cams = [cam; 8];
            let control = CamControl { enable: 0xFF, polarity: 0x0F };
            for (position, on) in positions.iter().zip(walk(cam, &positions)) {
                let expected = if on { 0xF0 } else { 0x0F };
                prop_assert_eq!(channel.update(&cams, control, *position), expected);
            }
        }

        #[test]
        fn any_limits_and_position_are_accepted(low: i32, high: i32, hysteresis: u16, position: u32, enable: u8) {
            let cams = [Cam { low, high, hysteresis }; 8];
            let state = CamChannel::default().update(&cams, CamControl { enable, polarity: 0 }, position);
            prop_assert_eq!(state & !enable, 0);
        }
    }

    #[test]
    fn a_disabled_cam_reads_zero_even_with_inverted_polarity() {
        let cams = [Cam { low: 0, high: 100, hysteresis: 0 }; 8];
        let control = CamControl { enable: 0, polarity: 0xFF };
        assert_eq!(CamChannel::default().update(&cams, control, 50), 0);
    }

    #[test]
    fn enabling_again_forgets_the_hysteresis() {
        let cams = [Cam { low: 10, high: 20, hysteresis: 5 }; 8];
        let on = CamControl { enable: 1, polarity: 0 };
        let mut channel = CamChannel::default();
        assert_eq!(channel.update(&cams, on, 20), 1);
        assert_eq!(channel.update(&cams, on, 25), 1);
        assert_eq!(channel.update(&cams, CamControl::default(), 25), 0);
        assert_eq!(channel.update(&cams, on, 25), 0);
    }
}
