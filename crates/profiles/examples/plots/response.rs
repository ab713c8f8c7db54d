//! The response of a pressure channel to a stimulus.

use profiles::pressure::{Channel, ChannelParameters, Span, Unit};

use crate::stimulus::{LENGTH, Stimulus};

/// A filter, by its objects 61A0h and 61A1h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Filter {
    /// The kind of filter, 61A0h.
    pub(crate) kind: u8,
    /// The constant of the filter, 61A1h.
    pub(crate) constant: u8,
}

/// A value over time: pairs of milliseconds and bar.
pub(crate) type Trace = Vec<(f64, f64)>;

impl Filter {
    /// The filters in the plots.
    pub(crate) const SHOWN: [Filter; 3] =
        [Filter { kind: 0, constant: 1 }, Filter { kind: 1, constant: 10 }, Filter { kind: 2, constant: 10 }];

    /// The name of the filter.
    pub(crate) fn name(self) -> &'static str {
        match self.kind {
            1 => "moving average",
            2 => "repeating average",
            _ => "none",
        }
    }

    pub(crate) fn file_name(self) -> String {
        self.name().replace(' ', "-")
    }

    fn channel(self) -> Channel {
        let span = Span { start: 0.0, end: 10.0 };
        let parameters = ChannelParameters::new(Unit::BAR, span);
        Channel::new(&ChannelParameters {
            filter_type: self.kind,
            filter_constant: self.constant,
            ..parameters
        })
    }
}

/// The process value of each millisecond, at the time of its publication. The input of the channel is the mean of 16
/// conversions in the millisecond before.
pub(crate) fn trace(filter: Filter, stimulus: Stimulus) -> Trace {
    let mut channel = filter.channel();
    let published = (1..=LENGTH).map(|ms| ms as f64);
    published.map(|ms| (ms, output(&mut channel, mean(stimulus, ms)))).collect()
}

fn output(channel: &mut Channel, pascal: f64) -> f64 {
    channel.sample(pascal as f32, true).process_value.into()
}

/// The mean of the 16 conversions of the millisecond that ends at `end`.
fn mean(stimulus: Stimulus, end: f64) -> f64 {
    (0..16).map(|number| stimulus.at(end - 1.0 + f64::from(number) / 16.0)).sum::<f64>() / 16.0
}

/// Samples after a step from 0 until the remaining difference stays below this share of the step.
///
/// # Panics
/// When the difference never stays below.
pub(crate) fn settling(filter: Filter, missing: f64) -> usize {
    let mut channel = filter.channel();
    output(&mut channel, 0.0);
    let is_settled = |value: f64| 1.0 - value <= missing * 1.000_001;
    (1..100_000).find(|_| is_settled(output(&mut channel, 100_000.0))).expect("it settles")
}

/// The number of samples that the output is behind a ramp, after the initial phase: the least and the greatest.
pub(crate) fn delay(filter: Filter) -> (f64, f64) {
    let mut channel = filter.channel();
    let behind = |sample: u32| f64::from(sample) - output(&mut channel, f64::from(sample) * 100.0) * 1000.0;
    let settled = (0..20_000).map(behind).skip(10_000).collect::<Vec<_>>();
    settled
        .iter()
        .fold((f64::INFINITY, 0.0), |(least, most), behind| (least.min(*behind), f64::max(most, *behind)))
}
