//! Recordings as a plot, with a chart for each unit.

use std::error::Error;
use std::io::{self, Write};
use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use super::rows::{Row, Sink, title};
use super::target::Target;
use crate::acquisition::Signal;
use crate::cli::Failure;
use crate::value::Value;

const WIDTH: u32 = 1000;
/// Height of a chart in pixels.
const HEIGHT: u32 = 320;

/// A line of a chart.
struct Line {
    title: String,
    points: Vec<(f64, f64)>,
}

/// The lines with one unit, which share an axis.
struct Chart {
    unit: String,
    lines: Vec<Line>,
}

/// Draws all signals with numbers in charts on one time axis, once all rows have come.
pub(super) struct Plot {
    to: Target,
    /// One line for each signal.
    lines: Vec<Line>,
    units: Vec<String>,
}

impl Plot {
    pub(super) fn new(to: Target, signals: &[Signal]) -> Plot {
        let lines = signals.iter().map(|signal| Line { title: title(signal), points: vec![] }).collect();
        Plot { to, lines, units: signals.iter().map(|signal| signal.unit.clone()).collect() }
    }
}

impl Sink for Plot {
    fn write(&mut self, row: &Row) -> Result<(), Failure> {
        for (line, value) in self.lines.iter_mut().zip(&row.values) {
            let number = value.as_ref().and_then(Value::as_f64).filter(|number| number.is_finite());
            line.points.extend(number.map(|number| (row.seconds, number)));
        }
        Ok(())
    }

    fn complete(self: Box<Self>) -> Result<(), Failure> {
        let Plot { mut to, lines, units } = *self;
        let text = draw(&charts(lines, units))
            .map_err(|error| Failure::Output(io::Error::other(error.to_string())))?;
        to.write_all(text.as_bytes())?;
        to.complete()
    }
}

/// Draws the charts. Returns the text of the file.
fn draw(charts: &[Chart]) -> Result<String, Box<dyn Error>> {
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

/// Groups the lines by their unit.
fn charts(lines: Vec<Line>, units: Vec<String>) -> Vec<Chart> {
    let mut charts: Vec<Chart> = Vec::new();
    for (line, unit) in lines.into_iter().zip(units).filter(|(line, _)| !line.points.is_empty()) {
        match charts.iter_mut().find(|chart| chart.unit == unit) {
            Some(chart) => chart.lines.push(line),
            None => charts.push(Chart { unit, lines: vec![line] }),
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

/// The range from the least to the greatest value, with a margin on each side as a share of the span. Never empty.
pub(in crate::cli) fn range(values: impl Iterator<Item = f64>, margin: f64) -> Range<f64> {
    let (low, high) = values
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    if low > high {
        return 0.0..1.0;
    }
    let span = high - low;
    // A constant line is drawn in the middle.
    let extra = if span > 0.0 { margin * span } else { low.abs().max(1.0) * 0.01 };
    low - extra..high + extra
}
