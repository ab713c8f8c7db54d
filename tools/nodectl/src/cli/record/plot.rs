//! The recording as a plot: a chart for each unit, one above the other.

use std::error::Error;
use std::ops::Range;

use canopen::Instant;
use plotters::coord::Shift;
use plotters::prelude::*;

use super::table::{seconds, title};
use crate::acquisition::{Sample, Signal};

const WIDTH: u32 = 1000;
/// Of one chart.
const HEIGHT: u32 = 320;

/// A line of a chart.
struct Line {
    title: String,
    points: Vec<(f64, f64)>,
}

/// What shares an axis.
struct Chart {
    unit: String,
    lines: Vec<Line>,
}

/// Draws all signals that are numbers, above one another on one time axis. The text of the file.
pub(super) fn draw(signals: &[Signal], samples: &[Sample]) -> Result<String, Box<dyn Error>> {
    let charts = charts(signals, samples);
    let rows = charts.len().max(1);
    let size = (WIDTH, HEIGHT * u32::try_from(rows)?);
    let mut text = String::new();
    let root = SVGBackend::with_string(&mut text, size).into_drawing_area();
    root.fill(&WHITE)?;
    let times = range(charts.iter().flat_map(Chart::points).map(|point| point.0), 0.0);
    for (chart, area) in charts.iter().zip(root.split_evenly((rows, 1))) {
        chart.draw(&area, times.clone())?;
    }
    root.present()?;
    drop(root);
    Ok(text)
}

fn charts(signals: &[Signal], samples: &[Sample]) -> Vec<Chart> {
    let start = samples.first().map_or(Instant(0), |sample| sample.at);
    let mut charts: Vec<Chart> = Vec::new();
    for (number, signal) in signals.iter().enumerate() {
        let of_signal = samples.iter().filter(|sample| sample.signal == number);
        let points = of_signal.filter_map(|sample| Some((seconds(start, sample.at), sample.value.as_f64()?)));
        let points: Vec<_> = points.filter(|(_, value)| value.is_finite()).collect();
        if points.is_empty() {
            continue;
        }
        let line = Line { title: title(signal), points };
        match charts.iter_mut().find(|chart| chart.unit == signal.unit) {
            Some(chart) => chart.lines.push(line),
            None => charts.push(Chart { unit: signal.unit.clone(), lines: vec![line] }),
        }
    }
    charts
}

impl Chart {
    fn points(&self) -> impl Iterator<Item = &(f64, f64)> {
        self.lines.iter().flat_map(|line| &line.points)
    }

    fn draw(&self, area: &DrawingArea<SVGBackend, Shift>, times: Range<f64>) -> Result<(), Box<dyn Error>> {
        let values = range(self.points().map(|point| point.1), 0.05);
        let mut builder = ChartBuilder::on(area);
        builder.margin(10).x_label_area_size(40).y_label_area_size(70);
        if let [line] = &self.lines[..] {
            builder.caption(&line.title, ("sans-serif", 16));
        }
        let mut chart = builder.build_cartesian_2d(times, values)?;
        chart.configure_mesh().x_desc("time s").y_desc(&self.unit).light_line_style(WHITE).draw()?;
        for (number, line) in self.lines.iter().enumerate() {
            let color = Palette99::pick(number).to_rgba();
            chart
                .draw_series(LineSeries::new(line.points.iter().copied(), color))?
                .label(&line.title)
                .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color));
        }
        if self.lines.len() > 1 {
            let mut legend = chart.configure_series_labels();
            legend.background_style(WHITE.mix(0.8)).border_style(BLACK).draw()?;
        }
        Ok(())
    }
}

/// From the least to the greatest, with a margin as a share of the way between them. Never empty.
pub(in crate::cli) fn range(values: impl Iterator<Item = f64>, margin: f64) -> Range<f64> {
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..1.0;
    }
    let span = high - low;
    // A line that does not move is drawn in the middle.
    let extra = if span > 0.0 { margin * span } else { low.abs().max(1.0) * 0.01 };
    low - extra..high + extra
}
