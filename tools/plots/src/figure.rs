//! The plot of one filter: a chart for each stimulus, one below the other.

use std::error::Error;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::stimulus::LENGTH;
use crate::{Filter, Stimulus, trace};

const SIZE: (u32, u32) = (900, 780);
const INPUT: RGBColor = RGBColor(150, 150, 150);
const OUTPUT: RGBColor = RGBColor(200, 40, 40);

/// The plot as text.
pub(crate) fn svg(filter: Filter) -> String {
    let mut text = String::new();
    draw(filter, &mut text).expect("a string takes everything");
    text
}

fn draw(filter: Filter, text: &mut String) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::with_string(text, SIZE).into_drawing_area();
    root.fill(&WHITE)?;
    let areas = root.split_evenly((Stimulus::ALL.len(), 1));
    for (stimulus, area) in Stimulus::ALL.into_iter().zip(areas) {
        chart(filter, stimulus, &area)?;
    }
    Ok(root.present()?)
}

fn chart(
    filter: Filter,
    stimulus: Stimulus,
    area: &DrawingArea<SVGBackend, Shift>,
) -> Result<(), Box<dyn Error>> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(10).x_label_area_size(35).y_label_area_size(45);
    builder.caption(stimulus.title(), ("sans-serif", 15));
    let mut chart = builder.build_cartesian_2d(0.0..LENGTH as f64, -0.3..5.3)?;
    chart.configure_mesh().x_desc("ms").y_desc("bar").light_line_style(WHITE).draw()?;
    let input = (0..=10 * LENGTH).map(|tenth| tenth as f64 / 10.0).map(|ms| (ms, stimulus.at(ms) / 1e5));
    chart.draw_series(LineSeries::new(input, INPUT))?.label("input").legend(|at| key(at, INPUT));
    let output = stairs(&trace(filter, stimulus));
    let title = format!("61A0h = {}, 61A1h = {}", filter.kind, filter.constant);
    chart.draw_series(LineSeries::new(output, OUTPUT))?.label(title).legend(|at| key(at, OUTPUT));
    let mut legend = chart.configure_series_labels();
    legend.position(SeriesLabelPosition::LowerRight).background_style(WHITE.mix(0.8)).border_style(BLACK);
    legend.draw()?;
    Ok(())
}

fn key((x, y): (i32, i32), color: RGBColor) -> PathElement<(i32, i32)> {
    PathElement::new([(x, y), (x + 18, y)], color)
}

/// A value holds until the next one.
fn stairs(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let ends = points.iter().skip(1).map(|(ms, _)| *ms).chain([LENGTH as f64]);
    points.iter().zip(ends).flat_map(|((ms, value), end)| [(*ms, *value), (end, *value)]).collect()
}
