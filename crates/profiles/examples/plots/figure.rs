//! A plot: charts over the same time, one below the other.

use std::error::Error;
use std::ops::Range;

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::response::Trace;
use crate::stimulus::LENGTH;

const WIDTH: u32 = 900;
const HEIGHT_OF_A_CHART: u32 = 260;
/// The colours of the true value and of the reading; the third colour is that of the node's value.
pub(crate) const INPUT: RGBColor = RGBColor(150, 150, 150);
pub(crate) const READ: RGBColor = RGBColor(40, 90, 200);
pub(crate) const OUTPUT: RGBColor = RGBColor(200, 40, 40);

/// A chart over the time of a plot.
pub(crate) struct Chart {
    pub(crate) title: String,
    pub(crate) unit: &'static str,
    pub(crate) range: Range<f64>,
    pub(crate) curves: Vec<Curve>,
}

/// A curve with its name in the legend.
pub(crate) struct Curve {
    pub(crate) name: String,
    pub(crate) color: RGBColor,
    pub(crate) points: Trace,
}

/// The colours of a plot on a dark page. The rules of a style precede the attributes of the drawing.
const DARK: &str = r##"<style>
@media (prefers-color-scheme: dark) {
  [fill="#FFFFFF"] { fill: #0d1117 }
  [stroke="#FFFFFF"] { stroke: #0d1117 }
  [fill="#000000"] { fill: #e6edf3 }
  [stroke="#000000"] { stroke: #c9d1d9 }
  [stroke="#285AC8"] { stroke: #6cb6ff }
  [stroke="#C82828"] { stroke: #ff7b72 }
}
</style>
"##;

/// The plot as SVG text.
pub(crate) fn svg(charts: &[Chart]) -> String {
    let mut text = String::new();
    draw(charts, &mut text).expect("a string takes everything");
    let head = text.find('\n').map_or(0, |end| end + 1);
    text.insert_str(head, DARK);
    text
}

fn draw(charts: &[Chart], text: &mut String) -> Result<(), Box<dyn Error>> {
    let rows = u32::try_from(charts.len())?;
    let root = SVGBackend::with_string(text, (WIDTH, HEIGHT_OF_A_CHART * rows)).into_drawing_area();
    root.fill(&WHITE)?;
    for (chart, area) in charts.iter().zip(root.split_evenly((charts.len(), 1))) {
        draw_one(chart, &area)?;
    }
    Ok(root.present()?)
}

fn draw_one(chart: &Chart, area: &DrawingArea<SVGBackend, Shift>) -> Result<(), Box<dyn Error>> {
    let mut builder = ChartBuilder::on(area);
    builder.margin(10).x_label_area_size(35).y_label_area_size(60);
    builder.caption(&chart.title, ("sans-serif", 15));
    let mut drawn = builder.build_cartesian_2d(0.0..LENGTH as f64, chart.range.clone())?;
    drawn.configure_mesh().x_desc("ms").y_desc(chart.unit).light_line_style(WHITE).draw()?;
    for curve in &chart.curves {
        let (name, color) = (curve.name.as_str(), curve.color);
        drawn
            .draw_series(LineSeries::new(curve.points.iter().copied(), color))?
            .label(name)
            .legend(move |at| key(at, color));
    }
    let mut legend = drawn.configure_series_labels();
    legend.position(SeriesLabelPosition::LowerRight).background_style(WHITE.mix(0.8)).border_style(BLACK);
    legend.draw()?;
    Ok(())
}

fn key((x, y): (i32, i32), color: RGBColor) -> PathElement<(i32, i32)> {
    PathElement::new([(x, y), (x + 18, y)], color)
}

/// A curve in steps: a value holds until the next one.
pub(crate) fn stairs(points: &[(f64, f64)]) -> Trace {
    let ends = points.iter().skip(1).map(|(ms, _)| *ms).chain([LENGTH as f64]);
    points.iter().zip(ends).flat_map(|((ms, value), end)| [(*ms, *value), (end, *value)]).collect()
}
