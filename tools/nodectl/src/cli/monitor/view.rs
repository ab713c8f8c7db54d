//! What is on the screen: a table of all signals, and a plot of the chosen one.

use std::collections::VecDeque;

use canopen::Instant;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Stylize;
use ratatui::symbols::Marker;
use ratatui::text::Line;
use ratatui::widgets::{Axis, Block, Chart, Dataset, GraphType, Paragraph, Row, Table};

use crate::acquisition::{Sample, Signal};
use crate::cli::record::{range, seconds_between};
use crate::object::Place;

/// A signal and what is known of its values.
struct Track {
    signal: Signal,
    newest: String,
    count: usize,
    low: f64,
    high: f64,
    /// Seconds since the start, and values.
    points: VecDeque<(f64, f64)>,
}

/// The state of the screen.
pub(super) struct View {
    tracks: Vec<Track>,
    chosen: usize,
    start: Option<Instant>,
    /// Of the newest sample, in seconds since the start.
    now: f64,
    /// What the plot shows, in seconds.
    window: f64,
    is_held: bool,
}

impl View {
    pub(super) fn new(signals: &[Signal], window: f64) -> View {
        let track = |signal: &Signal| Track {
            signal: signal.clone(),
            newest: "-".to_owned(),
            count: 0,
            low: f64::INFINITY,
            high: f64::NEG_INFINITY,
            points: VecDeque::new(),
        };
        let tracks = signals.iter().map(track).collect();
        View { tracks, chosen: 0, start: None, now: 0.0, window, is_held: false }
    }

    pub(super) fn take(&mut self, sample: &Sample) {
        let start = *self.start.get_or_insert(sample.at);
        if self.is_held {
            return;
        }
        self.now = seconds_between(start, sample.at);
        let oldest = self.now - self.window;
        if let Some(track) = self.tracks.get_mut(sample.signal) {
            track.take(sample, self.now, oldest);
        }
    }

    /// Chooses another signal.
    pub(super) fn choose(&mut self, step: isize) {
        self.chosen = self.chosen.saturating_add_signed(step).min(self.tracks.len().saturating_sub(1));
    }

    /// Holds the picture, or lets it go on.
    pub(super) fn hold(&mut self) {
        self.is_held = !self.is_held;
    }

    pub(super) fn draw(&self, frame: &mut Frame) {
        let rows = u16::try_from(self.tracks.len()).unwrap_or(u16::MAX).saturating_add(3);
        let areas = [Constraint::Max(rows), Constraint::Min(8), Constraint::Length(1)];
        let [table, plot, help] = Layout::vertical(areas).areas(frame.area());
        frame.render_widget(self.table(), table);
        self.draw_plot(frame, plot);
        let held = if self.is_held { "HELD  " } else { "" };
        let keys = format!("{held}up/down: choose   space: hold   q: quit");
        frame.render_widget(Paragraph::new(Line::from(keys).dim()), help);
    }

    fn table(&self) -> Table<'_> {
        let titles = ["object", "name", "value", "unit", "least", "greatest", "values"];
        let widths = [9, 36, 14, 8, 12, 12, 8].map(Constraint::Length);
        let rows = self.tracks.iter().enumerate().map(|(number, track)| {
            let row = track.row();
            if number == self.chosen { row.bold() } else { row }
        });
        Table::new(rows, widths).header(Row::new(titles).dim()).block(Block::bordered().title(" values "))
    }

    fn draw_plot(&self, frame: &mut Frame, area: Rect) {
        let Some(track) = self.tracks.get(self.chosen) else { return };
        let points: Vec<(f64, f64)> = track.points.iter().copied().collect();
        let dataset =
            Dataset::default().data(&points).marker(Marker::Braille).graph_type(GraphType::Line).cyan();
        let (from, to) = ((self.now - self.window).max(0.0), self.now.max(1.0));
        let values = range(points.iter().map(|point| point.1), 0.05);
        let title = format!(" {} {} ", track.signal.name, track.signal.unit);
        let chart = Chart::new(vec![dataset])
            .block(Block::bordered().title(title))
            .x_axis(axis(from, to, 1))
            .y_axis(axis(values.start, values.end, 3));
        frame.render_widget(chart, area);
    }
}

/// An axis with labels at its ends and in its middle.
fn axis(from: f64, to: f64, decimals: usize) -> Axis<'static> {
    let labels = [from, f64::midpoint(from, to), to].map(|value| format!("{value:.decimals$}"));
    Axis::default().bounds([from, to]).labels(labels).dim()
}

impl Track {
    fn take(&mut self, sample: &Sample, now: f64, oldest: f64) {
        self.newest = sample.value.to_string();
        self.count += 1;
        if let Some(value) = sample.value.as_f64().filter(|value| value.is_finite()) {
            (self.low, self.high) = (self.low.min(value), self.high.max(value));
            self.points.push_back((now, value));
        }
        while self.points.front().is_some_and(|point| point.0 < oldest) {
            self.points.pop_front();
        }
    }

    fn row(&self) -> Row<'_> {
        let bound = |value: f64| if value.is_finite() { value.to_string() } else { "-".to_owned() };
        Row::new([
            Place(self.signal.at).to_string(),
            self.signal.name.clone(),
            self.newest.clone(),
            self.signal.unit.clone(),
            bound(self.low),
            bound(self.high),
            self.count.to_string(),
        ])
    }
}
