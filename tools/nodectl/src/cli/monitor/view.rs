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
    least: Option<(f64, String)>,
    greatest: Option<(f64, String)>,
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
            least: None,
            greatest: None,
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

    /// `hint` says why there may be no values.
    pub(super) fn draw(&self, frame: &mut Frame, hint: Option<&str>) {
        let rows = u16::try_from(self.tracks.len()).unwrap_or(u16::MAX).saturating_add(3);
        let areas = [Constraint::Max(rows), Constraint::Min(8), Constraint::Length(1)];
        let [table, plot, help] = Layout::vertical(areas).areas(frame.area());
        frame.render_widget(self.table(), table);
        self.draw_plot(frame, plot);
        let held = if self.is_held { "HELD   " } else { "" };
        let hint = hint.map(|hint| format!("   {hint}")).unwrap_or_default();
        let keys = format!("{held}up/down: choose   space: hold   q: quit{hint}");
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
            self.points.push_back((now, value));
            keep(&mut self.least, value, &self.newest, |value, least| value < least);
            keep(&mut self.greatest, value, &self.newest, |value, greatest| value > greatest);
        }
        while self.points.front().is_some_and(|point| point.0 < oldest) {
            self.points.pop_front();
        }
    }

    fn row(&self) -> Row<'_> {
        let text = |bound: &Option<(f64, String)>| {
            bound.as_ref().map_or_else(|| "-".to_owned(), |(_, text)| text.clone())
        };
        Row::new([
            Place(self.signal.at).to_string(),
            self.signal.name.clone(),
            self.newest.clone(),
            self.signal.unit.clone(),
            text(&self.least),
            text(&self.greatest),
            self.count.to_string(),
        ])
    }
}

/// Keeps a value and its text if it is further out than the one before.
fn keep(bound: &mut Option<(f64, String)>, value: f64, text: &str, is_further: impl Fn(f64, f64) -> bool) {
    if bound.as_ref().is_none_or(|(kept, _)| is_further(value, *kept)) {
        *bound = Some((value, text.to_owned()));
    }
}

#[cfg(test)]
mod tests {
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;
    use crate::object::at;
    use crate::value::Value;

    fn view() -> View {
        let signals =
            [Signal::polled(at(0x6130, 1), "Pressure", "bar"), Signal::polled(at(0x1008, 0), "Name", "")];
        View::new(&signals, 10.0)
    }

    fn take(view: &mut View, second: u64, value: f32) {
        view.take(&Sample { at: Instant(second * 1_000_000), signal: 0, value: Value::Real32(value) });
    }

    fn screen(view: &View, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view.draw(frame, None)).unwrap();
        let cells = terminal.backend().buffer().content().chunks(usize::from(width));
        cells.map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect()).collect()
    }

    #[test]
    fn the_table_has_newest_least_and_greatest() {
        let mut view = view();
        for (second, value) in [(5, 1.5), (6, 0.1), (7, 2.25)] {
            take(&mut view, second, value);
        }
        view.take(&Sample { at: Instant(7), signal: 1, value: Value::Text("node".into()) });
        let screen = screen(&view, 110, 30);
        let row = screen[2].split_whitespace().collect::<Vec<_>>();
        assert_eq!(row, ["\u{2502}6130h:1", "Pressure", "2.25", "bar", "0.1", "2.25", "3", "\u{2502}"]);
        let row = screen[3].split_whitespace().collect::<Vec<_>>();
        assert_eq!(row, ["\u{2502}1008h:0", "Name", "node", "-", "-", "1", "\u{2502}"]);
    }

    #[test]
    fn the_plot_shows_the_window_and_forgets_the_rest() {
        let mut view = view();
        for second in 0..100 {
            take(&mut view, second, second as f32);
        }
        assert_eq!(view.tracks[0].points.len(), 11);
        let screen = screen(&view, 110, 30).join("\n");
        for label in ["89.0", "94.0", "99.0"] {
            assert!(screen.contains(label), "{screen}");
        }
    }

    #[test]
    fn what_is_held_does_not_change() {
        let mut view = view();
        take(&mut view, 1, 1.0);
        view.hold();
        let before = screen(&view, 110, 30);
        take(&mut view, 2, 2.0);
        assert_eq!(screen(&view, 110, 30), before);
        view.hold();
        take(&mut view, 3, 3.0);
        assert_ne!(screen(&view, 110, 30), before);
    }

    #[test]
    fn no_terminal_is_too_small_and_no_choice_out_of_range() {
        let mut view = view();
        take(&mut view, 1, f32::NAN);
        for step in [-1, 1, 1, 1, isize::MAX, isize::MIN] {
            view.choose(step);
            for (width, height) in [(1, 1), (10, 3), (40, 10), (200, 80)] {
                screen(&view, width, height);
            }
        }
        let mut empty = View::new(&[], 10.0);
        empty.choose(1);
        screen(&empty, 80, 25);
    }
}
