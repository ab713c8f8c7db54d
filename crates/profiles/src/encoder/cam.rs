//! Electronic cams: objects 6300h to 6337h, eight a channel.

/// One cam of one channel.
///
/// A cam becomes active from the low to the high limit, both included. A limit below zero is a position at the end of the
/// range, so a window can go across zero. The cam stays active until the position is further outside than
/// the hysteresis. Limits in the wrong order are swapped (CiA 406 is silent about them).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cam {
    /// Low limit (6310h to 6317h).
    pub low: i32,
    /// High limit (6320h to 6327h).
    pub high: i32,
    /// Hysteresis (6330h to 6337h), in measuring units.
    pub hysteresis: u16,
}

/// The cams of one channel with their enable and polarity bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cams {
    /// The cams, in the order of their bits.
    pub cams: [Cam; 8],
    /// Cam enable (6301h): bit n - 1 for cam n.
    pub enable: u8,
    /// Cam polarity (6302h): a set bit shows an active cam as 0.
    pub polarity: u8,
}

/// An interval of positions, which repeat after the range: limits below zero are positions at the end of the range.
#[derive(Clone, Copy, Debug, Default)]
struct Window {
    low: u32,
    /// Highest position minus lowest position.
    length: u32,
}

impl Window {
    /// The interval of the cam, with `margin` added on both sides; `true` with the interval of all other positions, for a
    /// cam across the end of the range.
    #[inline(never)]
    fn new(cam: &Cam, margin: u16, range: i64) -> (Window, bool) {
        let low = i64::from(cam.low.min(cam.high)) - i64::from(margin);
        let high = i64::from(cam.low.max(cam.high)) + i64::from(margin);
        let length = high - low;
        let low = low.checked_rem_euclid(range).unwrap_or(0);
        let end = low + length;
        if length >= range - 1 {
            (Window { low: 0, length: u32::MAX }, false)
        } else if end < range {
            (Window::of(low, length), false)
        } else {
            (Window::of(end - range + 1, range - length - 2), true)
        }
    }

    /// Both are below the range, at most 2^32.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    fn of(low: i64, length: i64) -> Window {
        Window { low: low as u32, length: length as u32 }
    }

    /// 1 outside of the window, 0 inside: the borrow of the comparison, without a branch.
    fn is_outside(self, position: u32) -> u32 {
        let difference = u64::from(self.length).wrapping_sub(position.wrapping_sub(self.low).into());
        u32::from(difference > u64::from(u32::MAX))
    }
}

/// The cams of one channel as position windows, with the state that hysteresis needs.
#[derive(Clone, Debug, Default)]
pub struct CamChannel {
    enable: u8,
    polarity: u8,
    /// Bits of the cams with a window of all other positions, in the order of `windows`.
    inverted: [u8; 2],
    /// Bits of the cams that begin within the range.
    reachable: u8,
    /// For each cam: the window in which the cam becomes active, and the window in which it stays active.
    windows: [[Window; 2]; 8],
    /// The one of its two windows that each cam has at present.
    present: [Window; 8],
    active: u8,
}

impl CamChannel {
    /// Takes over parameters. Positions repeat after `range`, at most 2^32.
    pub fn apply(&mut self, cams: &Cams, range: i64) {
        (self.enable, self.polarity, self.reachable) = (cams.enable, cams.polarity, 0);
        self.inverted = [0; 2];
        for ((cam, windows), bit) in cams.cams.iter().zip(&mut self.windows).zip(BITS) {
            let margins = [0, cam.hysteresis];
            for ((window, inverted), margin) in windows.iter_mut().zip(&mut self.inverted).zip(margins) {
                let (new, is_inverted) = Window::new(cam, margin, range);
                *window = new;
                *inverted |= if is_inverted { bit } else { 0 };
            }
            self.reachable |= if i64::from(cam.low.min(cam.high)) < range { bit } else { 0 };
        }
        self.activate(self.active);
    }

    /// The cam state register (6300h) at `position`. A disabled cam reads 0 whatever its polarity: 6301h says that its
    /// calculation is off and its state permanently 0. A disabled cam also forgets its state, so after enabling, the
    /// limits alone decide.
    pub fn update(&mut self, position: u32) -> u8 {
        let add = |bits, window: &Window| bits << 1 | window.is_outside(position);
        let pairs = self.present.as_chunks::<2>().0.iter().rev();
        let [outside, ..] = pairs.fold(0_u32, |bits, [low, high]| add(add(bits, high), low)).to_le_bytes();
        let [on, stay] = self.inverted;
        let inverted = (on & !self.active) | (stay & self.active);
        let active = !(outside ^ inverted) & self.enable & self.reachable;
        if active != self.active {
            self.activate(active);
        }
        (self.active ^ self.polarity) & self.enable
    }

    /// Takes over which cams are active, and with it their windows.
    #[inline(never)]
    fn activate(&mut self, active: u8) {
        self.active = active;
        for ((present, [on, stay]), bit) in self.present.iter_mut().zip(&self.windows).zip(BITS) {
            *present = if active & bit == 0 { *on } else { *stay };
        }
    }
}

const BITS: [u8; 8] = [1, 2, 4, 8, 16, 32, 64, 128];

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn channel(cam: Cam, enable: u8, polarity: u8) -> CamChannel {
        let mut channel = CamChannel::default();
        channel.apply(&Cams { cams: [cam; 8], enable, polarity }, WHOLE);
        channel
    }

    /// Limits near both ends of the ranges of positions and limits, and near each other.
    fn any_limit() -> impl Strategy<Value = i32> {
        prop_oneof![-50..150_i32, Just(i32::MIN), Just(i32::MAX), i32::MAX - 50..i32::MAX, any::<i32>()]
    }

    fn any_position() -> impl Strategy<Value = u32> {
        let edge = i32::MAX.unsigned_abs();
        prop_oneof![0..200_u32, edge - 60..edge + 60, u32::MAX - 50..=u32::MAX, any::<u32>()]
    }

    prop_compose! {
        fn any_cam()(
            low in any_limit(), high in any_limit(), hysteresis in prop_oneof![0..20_u16, any::<u16>()],
        ) -> Cam {
            Cam { low, high, hysteresis }
        }
    }

    const WHOLE: i64 = 1 << 32;

    /// The same rule, step by step: a cam becomes active inside its window and inactive beyond the margin.
    fn walk(cam: Cam, positions: &[u32], range: i64) -> Vec<bool> {
        let (low, high) = (i64::from(cam.low.min(cam.high)), i64::from(cam.low.max(cam.high)));
        let margin = i64::from(cam.hysteresis);
        let mut on = false;
        let mut states = Vec::new();
        for position in positions.iter().map(|p| i64::from(*p)) {
            let seen = [position, position - range, position + range];
            let seen = &seen[..if low - margin < range { 3 } else { 2 }];
            let on_seen = &seen[..if low < range { seen.len() } else { 2 }];
            if on_seen.iter().any(|p| (low..=high).contains(p)) {
                on = true;
            } else if !seen.iter().any(|p| (low - margin..=high + margin).contains(p)) {
                on = false;
            }
            states.push(on);
        }
        states
    }

    proptest! {
        #[test]
        fn agrees_with_a_walk(
            cams in prop::array::uniform8(any_cam()), enable: u8, polarity: u8,
            positions in prop::collection::vec(any_position(), 1..60),
        ) {
            let mut channel = CamChannel::default();
            channel.apply(&Cams { cams, enable, polarity }, WHOLE);
            let walks = cams.map(|cam| walk(cam, &positions, WHOLE));
            for (i, position) in positions.into_iter().enumerate() {
                let active = walks.iter().zip(BITS).map(|(walk, bit)| if walk[i] { bit } else { 0 }).sum::<u8>();
                prop_assert_eq!(channel.update(position), (active ^ polarity) & enable);
            }
        }
    }

    #[test]
    fn a_disabled_cam_reads_zero_even_with_inverted_polarity() {
        let cam = Cam { low: 0, high: 100, hysteresis: 0 };
        assert_eq!(channel(cam, 0, 0xFF).update(50), 0);
    }

    #[test]
    fn new_limits_keep_the_state_and_enabling_again_forgets_it() {
        let cam = Cam { low: 10, high: 20, hysteresis: 5 };
        let cams = |enable| Cams { cams: [cam; 8], enable, polarity: 0 };
        let mut channel = channel(cam, 1, 0);
        assert_eq!(channel.update(20), 1);
        channel.apply(&cams(1), WHOLE);
        assert_eq!(channel.update(25), 1);
        channel.apply(&cams(0), WHOLE);
        assert_eq!(channel.update(25), 0);
        channel.apply(&cams(1), WHOLE);
        assert_eq!(channel.update(25), 0);
    }

    /// 19 changes in a dither over zero, with a hysteresis of 10 (E30).
    #[test]
    fn hysteresis_and_windows_go_across_zero() {
        let range = 36_000;
        let states = |cam: Cam, positions: &[u32]| {
            let mut channel = CamChannel::default();
            channel.apply(&Cams { cams: [cam; 8], enable: 1, polarity: 0 }, range);
            positions.iter().map(|position| channel.update(*position)).collect::<Vec<u8>>()
        };
        let dither: Vec<u32> = (0..20).map(|n| if n % 2 == 0 { 3 } else { 35_995 }).collect();
        assert_eq!(states(Cam { low: 0, high: 100, hysteresis: 10 }, &dither), [1; 20]);
        assert_eq!(states(Cam { low: 35_900, high: 35_999, hysteresis: 10 }, &dither)[1..], [1; 19]);
        let across =
            [35_899, 35_900, 35_999, 0, 100, 101].map(|at| (at, u8::from(at != 35_899 && at != 101)));
        for (low, high) in [(-100, 100), (35_900, 36_100)] {
            for (at, state) in across {
                assert_eq!(
                    states(Cam { low, high, hysteresis: 0 }, &[at]),
                    [state],
                    "{low} to {high} at {at}"
                );
            }
        }
        assert_eq!(
            states(Cam { low: 36_000, high: 36_100, hysteresis: 0 }, &[0, 50]),
            [0, 0],
            "beyond the range"
        );
    }
}
