//! The plot of one filter: a chart for each stimulus.

use crate::figure::{Chart, Curve, INPUT, OUTPUT, stairs, svg};
use crate::response::{Filter, trace};
use crate::stimulus::LENGTH;
use crate::stimulus::Stimulus;

/// The plot as SVG text.
pub(crate) fn plot(filter: Filter) -> String {
    svg(&Stimulus::ALL.map(|stimulus| chart(filter, stimulus)))
}

fn chart(filter: Filter, stimulus: Stimulus) -> Chart {
    let tenths = (0..=10 * LENGTH).map(|tenth| tenth as f64 / 10.0);
    let input = tenths.map(|ms| (ms, stimulus.at(ms) / 1e5)).collect();
    let output = stairs(&trace(filter, stimulus));
    let name = format!("61A0h = {}, 61A1h = {}", filter.kind, filter.constant);
    Chart {
        title: stimulus.title().into(),
        unit: "bar",
        range: -0.3..5.3,
        curves: vec![
            Curve { name: "input".into(), color: INPUT, points: input },
            Curve { name, color: OUTPUT, points: output },
        ],
    }
}
