//! Plots over time: the chosen signal, and the signals after it while there is room.

use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Stylize;
use ratatui::symbols::Marker;
use ratatui::widgets::{Axis, Block, Borders, Chart, Dataset, GraphType};

use super::view::Track;
use crate::cli::record::range;

/// The least height and width of a useful plot.
const LOWEST: u16 = 5;
const NARROWEST: u16 = 20;

pub(super) fn draw(frame: &mut Frame, area: Rect, tracks: &[Track], chosen: usize, now: f64, window: f64) {
    let room = usize::from(area.height / LOWEST);
    if area.width < NARROWEST || room == 0 || tracks.is_empty() {
        return;
    }
    let count = room.min(tracks.len());
    let first = chosen.min(tracks.len() - count);
    let areas = Layout::vertical(vec![Constraint::Fill(1); count]).split(area);
    for (area, track) in areas.iter().zip(&tracks[first..]) {
        draw_one(frame, *area, track, now, window);
    }
}

fn draw_one(frame: &mut Frame, area: Rect, track: &Track, now: f64, window: f64) {
    let (from, to) = ((now - window).max(0.0), now.max(1.0));
    let points: Vec<(f64, f64)> = track.points.iter().copied().filter(|point| point.0 >= from).collect();
    let dataset = Dataset::default().data(&points).marker(Marker::Braille).graph_type(GraphType::Line).cyan();
    let values = range(points.iter().map(|point| point.1), 0.05);
    let title = format!(" {} [{}] ", track.signal.name, track.signal.unit);
    let chart = Chart::new(vec![dataset])
        .block(Block::new().borders(Borders::TOP).title(title))
        .x_axis(axis(from, to, 1, " s"))
        .y_axis(axis(values.start, values.end, 3, ""));
    frame.render_widget(chart, area);
}

/// An axis with labels at its ends and in its middle.
fn axis(from: f64, to: f64, decimals: usize, unit: &str) -> Axis<'static> {
    let labels = [from, f64::midpoint(from, to), to].map(|value| format!("{value:.decimals$}{unit}"));
    Axis::default().bounds([from, to]).labels(labels).dim()
}
