//! Random inputs: nothing overflows (tests run with overflow checks), and values stay in their ranges.

use profiles::board::{Board, RawEncoder, SsiFrame};
use profiles::profile::Chain;
use std::num::{NonZeroU16, NonZeroU32};

use profiles::encoder::{
    Area, Cam, Cams, ChannelParameters, Coding, Command, Encoder, Format, Limits, LongSpeed, Module,
    Parameters, Parity, PositionRecord, RetainedState, SensorType, Start,
};
use proptest::prelude::*;

#[allow(clippy::cast_possible_truncation)]
fn any_channel() -> impl Strategy<Value = ChannelParameters> {
    let cam = any::<(i32, i32, u16)>().prop_map(|(low, high, hysteresis)| Cam { low, high, hysteresis });
    let cams = (prop::array::uniform8(cam), any::<(u8, u8)>());
    let sensor = (0..=9_u8, any::<(NonZeroU32, NonZeroU16, u32)>());
    (sensor, cams, any::<(i32, i32, u32)>(), 0..3_u8).prop_map(
        |((kind, (resolution, counted, fastest)), (cams, (enable, polarity)), (low, high, value), count)| {
            ChannelParameters {
                kind: SensorType::from_code(kind),
                resolution,
                counted,
                fastest: if fastest % 2 == 0 { 0 } else { fastest },
                preset: Command { value, count },
                cams: Cams { cams, enable, polarity },
                area: Area { low, high },
                cam_delay: low as i16,
                offset: low,
                users: 1,
                references: [count; 4],
            }
        },
    )
}

fn any_format() -> impl Strategy<Value = Format> {
    (0..=16_u8, 1..=16_u8, any::<(bool, bool)>(), 0..3_u8).prop_map(
        |(turns, steps, (gray, alarm), parity)| {
            let coding = if gray { Coding::Gray } else { Coding::Binary };
            let parity = [Parity::None, Parity::Even, Parity::Odd][usize::from(parity)];
            Format::new(turns, steps, coding, alarm, parity).unwrap()
        },
    )
}

fn any_parameters() -> impl Strategy<Value = Parameters> {
    let units = (0..16_u16, any::<(u32, u32, u32, u32)>());
    let rest = (any_format(), any::<(bool, i32, i32, i32)>(), any::<[u16; 4]>(), any::<(u32, u32, u32)>());
    (units, prop::array::uniform2(any_channel()), rest).prop_map(
        |(
            (operating, (per_revolution, range, step, speed_step)),
            channels,
            (format, module, limits, last),
        )| {
            let (index, offset, low, high) = module;
            let [lowest_supply, highest_supply, highest_current, lowest_battery] = limits;
            let (operating_time, value, travel) = last;
            Parameters {
                operating,
                per_revolution,
                gear: NonZeroU16::new(highest_current).unwrap_or(NonZeroU16::MIN),
                long_speed: LongSpeed {
                    is_in_own_unit: index,
                    millis: NonZeroU16::new(lowest_battery).unwrap_or(NonZeroU16::MIN),
                },
                range,
                step,
                speed_step,
                travel: NonZeroU32::new(travel).filter(|_| index),
                channels,
                format,
                index,
                module: Module { offset, low, high },
                limits: Limits {
                    lowest_supply,
                    highest_supply,
                    highest_current,
                    lowest_battery,
                    operating_time,
                },
                acknowledge: Command { value, count: u8::from(index) },
            }
        },
    )
}

fn any_raw() -> impl Strategy<Value = RawEncoder> {
    let frame = (any::<u64>(), 0..70_u32).prop_map(|(bits, clocks)| SsiFrame { bits, clocks });
    (any::<(u16, Option<u16>)>(), prop::option::of(frame), any::<[Option<u16>; 3]>(), any::<(bool, bool)>())
        .prop_map(|((counter, index), ssi, [supply, current, battery], (watchdog_reset, memory_error))| {
            RawEncoder {
                has_gap: watchdog_reset,
                counter,
                index,
                ssi,
                board: Board { supply, current, battery, watchdog_reset, memory_error },
            }
        })
}

fn any_start() -> impl Strategy<Value = Start> {
    let retained = any::<[u32; RetainedState::WORDS]>()
        .prop_map(|words| Start::Retained(RetainedState::from_words(&words)));
    let lost = any::<[u32; 2]>().prop_map(|words| Start::Lost(PositionRecord::from_words(words)));
    let damaged = any::<[u32; 2]>().prop_map(|words| Start::Damaged(PositionRecord::from_words(words)));
    prop_oneof![Just(Start::First), lost, damaged, retained]
}

proptest! {
    #[test]
    fn nothing_overflows(
        start in any_start(),
        life in prop::collection::vec((any_parameters(), prop::collection::vec(any_raw(), 0..20)), 1..6),
    ) {
        let mut encoder = Encoder::new(start);
        for (parameters, samples) in life {
            encoder.apply(&parameters);
            for raw in samples {
                let snapshot = encoder.sample(&raw);
                for (values, own) in snapshot.channels.iter().zip(&parameters.channels) {
                    let range = parameters.sensor(own).map_or(1 << 32, |sensor| parameters.scale(&sensor).range().get());
                    prop_assert!(u64::from(values.position) < range);
                    prop_assert_eq!(values.cams & !own.cams.enable, 0);
                }
            }
            let retained = encoder.retained_state();
            prop_assert_eq!(RetainedState::from_words(&retained.to_words()), retained);
        }
    }

    /// A start with any retained state and the same parameters retains the same state again.
    #[test]
    fn keeping_loses_nothing(parameters in any_parameters(), samples in prop::collection::vec(any_raw(), 0..20)) {
        let mut encoder = Encoder::default();
        encoder.apply(&parameters);
        for raw in samples {
            encoder.sample(&raw);
        }
        let retained = encoder.retained_state();
        let mut again = Encoder::new(Start::Retained(retained));
        again.apply(&parameters);
        let both = retained.channels.iter().zip(again.retained_state().channels);
        for ((first, second), own) in both.zip(&parameters.channels) {
            prop_assert!(*first == second || own.kind.is_none_or(|kind| !kind.is_retained()));
        }
    }
}
