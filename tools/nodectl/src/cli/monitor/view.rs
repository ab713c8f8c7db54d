//! The screen: the node, a table of all signals, and plots of as many signals as there is room for.

use std::collections::VecDeque;
use std::sync::Arc;

use canopen::Instant;
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout};
use ratatui::style::Stylize;
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph};

use super::status::Status;
use super::{plot, table};
use crate::acquisition::{Sample, Signal};
use crate::cli::record::seconds_between;
use crate::{Catalogue, meaning};

/// The shortest and the longest time span of the plots in seconds. Points are kept for the longest span.
const SHORTEST: f64 = 1.0;
const LONGEST: f64 = 600.0;

/// The keys and their functions.
const KEYS: [&str; 6] = [
    "up, down  choose a signal",
    "+, -      less or more time in the plots",
    "space     hold the picture, or let it go on",
    "?         these lines",
    "q, Esc    quit",
    "",
];

/// A signal and the statistics of its values.
pub(super) struct Track {
    pub(super) signal: Signal,
    pub(super) newest: String,
    /// The meaning of the newest value.
    pub(super) meaning: Option<String>,
    pub(super) count: usize,
    pub(super) least: Option<(f64, String)>,
    pub(super) greatest: Option<(f64, String)>,
    /// The points of the plot: seconds since the start, and value.
    pub(super) points: VecDeque<(f64, f64)>,
}

/// The state of the screen.
pub(super) struct View {
    catalogue: Arc<Catalogue>,
    tracks: Vec<Track>,
    chosen: usize,
    start: Option<Instant>,
    /// The time of the newest sample, in seconds since the start.
    now: f64,
    /// The time span of the plot in seconds.
    window: f64,
    is_held: bool,
    has_help: bool,
}

impl View {
    pub(super) fn new(signals: &[Signal], catalogue: Arc<Catalogue>, window: f64) -> View {
        let tracks = signals.iter().map(Track::new).collect();
        View { catalogue, tracks, chosen: 0, start: None, now: 0.0, window, is_held: false, has_help: false }
    }

    pub(super) fn take(&mut self, sample: &Sample) {
        let start = *self.start.get_or_insert(sample.at);
        if self.is_held {
            return;
        }
        self.now = seconds_between(start, sample.at);
        let oldest = self.now - LONGEST;
        if let Some(track) = self.tracks.get_mut(sample.signal) {
            track.take(sample, self.now, oldest);
            track.meaning = meaning::of(&self.catalogue, track.signal.at, &sample.value);
        }
    }

    /// Takes the unit of a signal. Values in a former unit are no longer shown.
    pub(super) fn follow(&mut self, number: usize, signal: &Signal) {
        if let Some(track) = self.tracks.get_mut(number).filter(|track| track.signal.unit != signal.unit) {
            *track = Track::new(signal);
        }
    }

    /// Chooses another signal.
    pub(super) fn choose(&mut self, step: isize) {
        self.chosen = self.chosen.saturating_add_signed(step).min(self.tracks.len().saturating_sub(1));
    }

    /// Freezes the screen, or continues.
    pub(super) fn hold(&mut self) {
        self.is_held = !self.is_held;
    }

    /// Doubles or halves the time span of the plots.
    pub(super) fn zoom(&mut self, is_in: bool) {
        let window = if is_in { self.window / 2.0 } else { self.window * 2.0 };
        self.window = window.clamp(SHORTEST, LONGEST);
    }

    /// Shows or hides the help on keys.
    pub(super) fn help(&mut self) {
        self.has_help = !self.has_help;
    }

    pub(super) fn draw(&self, frame: &mut Frame, status: &Status) {
        let [head, body, foot] =
            Layout::vertical([Constraint::Length(1), Constraint::Min(0), Constraint::Length(1)])
                .areas(frame.area());
        frame.render_widget(Paragraph::new(status.line(head.width)), head);
        frame.render_widget(Paragraph::new(self.foot(foot.width, status)), foot);
        if self.has_help {
            frame.render_widget(
                Paragraph::new(KEYS.join("\n")).block(Block::bordered().title(" keys ")),
                body,
            );
            return;
        }
        // The table has priority: plots get the remaining room.
        let rows = u16::try_from(self.tracks.len()).unwrap_or(u16::MAX).saturating_add(1);
        let [values, plots] = Layout::vertical([Constraint::Length(rows), Constraint::Min(0)]).areas(body);
        table::draw(frame, values, &self.tracks, self.chosen);
        plot::draw(frame, plots, &self.tracks, self.chosen, self.now, self.window);
    }

    fn foot(&self, width: u16, status: &Status) -> Line<'static> {
        let held = if self.is_held { "HELD  " } else { "" };
        let long = format!("{held}up/down choose   space hold   +/- {} s   ? keys   q quit", self.window);
        let keys = if long.len() <= width.into() { long } else { format!("{held}? keys  q quit") };
        match &status.hint {
            Some(hint) => Line::from(hint.clone()).yellow(),
            None => Line::from(keys).dim(),
        }
    }
}

impl Track {
    fn new(signal: &Signal) -> Track {
        Track {
            signal: signal.clone(),
            newest: "-".to_owned(),
            meaning: None,
            count: 0,
            least: None,
            greatest: None,
            points: VecDeque::new(),
        }
    }

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
}

/// Replaces a bound (a value and its text) if the new value is further out.
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

    fn catalogue() -> Arc<Catalogue> {
        Arc::new(Catalogue::of_file("pressure.eds").unwrap())
    }

    fn view() -> View {
        let signals =
            [Signal::polled(at(0x6130, 1), "Pressure", "bar"), Signal::polled(at(0x1008, 0), "Name", "")];
        View::new(&signals, catalogue(), 10.0)
    }

    fn take(view: &mut View, second: u64, value: f32) {
        view.take(&Sample { at: Instant(second * 1_000_000), signal: 0, value: Value::Real32(value) });
    }

    fn status() -> Status {
        Status { node: 1, state: "operational", emergency: None, rate: Some(51), hint: None }
    }

    fn screen(view: &View, width: u16, height: u16) -> Vec<String> {
        drawn(view, &status(), width, height)
    }

    fn drawn(view: &View, status: &Status, width: u16, height: u16) -> Vec<String> {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view.draw(frame, status)).unwrap();
        let cells = terminal.backend().buffer().content().chunks(usize::from(width));
        cells.map(|row| row.iter().map(ratatui::buffer::Cell::symbol).collect()).collect()
    }

    /// Two sensors for a minute, one in a unit with a long name.
    fn two_sensors() -> View {
        let signals = [
            Signal::polled(at(0x6130, 1), "Pressure process value", "bar"),
            Signal::polled(at(0x6130, 2), "Temperature process value", "\u{b0}C"),
        ];
        let mut view = View::new(&signals, catalogue(), 30.0);
        for step in 0..240_u32 {
            let (at, angle) = (Instant(u64::from(step) * 250_000), f64::from(step) / 8.0);
            #[allow(clippy::cast_possible_truncation)] // The value has only the digits of the sensor.
            let value = (2.5 + angle.sin()) as f32;
            view.take(&Sample { at, signal: 0, value: Value::Real32(value) });
            view.take(&Sample { at, signal: 1, value: Value::Real32(25.125) });
        }
        view
    }

    #[test]
    fn a_status_is_shown_with_its_meaning() {
        let signals = [Signal::polled(at(0x6150, 1), "Pressure status", "")];
        let mut view = View::new(&signals, catalogue(), 10.0);
        view.take(&Sample { at: Instant(0), signal: 0, value: Value::Integer(3) });
        let picture = screen(&view, 120, 10).join("\n");
        assert!(picture.contains("Pressure status [not valid, positive"), "{picture}");
    }

    /// The expected pictures are in files beside the tests; SCREENS=write writes them.
    #[test]
    fn pictures_from_the_smallest_terminal_to_a_large_one() {
        let status = Status { emergency: Some("8130h heartbeat or life guarding error".into()), ..status() };
        for (width, height) in [(40, 10), (80, 24), (120, 40)] {
            let lines = drawn(&two_sensors(), &status, width, height);
            let picture: String = lines.iter().map(|line| format!("{}\n", line.trim_end())).collect();
            let path = format!("{}/tests/screens/monitor-{width}x{height}.txt", env!("CARGO_MANIFEST_DIR"));
            if std::env::var("SCREENS").is_ok_and(|value| value == "write") {
                std::fs::write(&path, &picture).unwrap();
            }
            assert_eq!(picture, std::fs::read_to_string(&path).unwrap(), "{path}");
        }
    }

    #[test]
    fn no_value_and_no_unit_is_lost_on_any_terminal() {
        for width in 24..200 {
            for height in [6, 10, 24, 60] {
                let picture = drawn(&two_sensors(), &status(), width, height).join("\n");
                for text in ["bar", "25.125", "\u{b0}C", "q quit"] {
                    assert!(picture.contains(text), "{width}x{height}: {text}\n{picture}");
                }
            }
        }
    }

    #[test]
    fn keys_zoom_and_explain() {
        let mut view = two_sensors();
        view.zoom(true);
        assert!(screen(&view, 80, 24).join("\n").contains("+/- 15 s"));
        (0..20).for_each(|_| view.zoom(false));
        assert!(screen(&view, 80, 24).join("\n").contains("+/- 600 s"));
        view.help();
        assert!(screen(&view, 40, 10).join("\n").contains("hold the picture"));
        view.help();
        assert!(!screen(&view, 40, 10).join("\n").contains("hold the picture"));
    }

    #[test]
    fn the_head_shows_the_node_and_the_foot_the_fault() {
        let status = Status { state: "stopped", hint: Some("the node is stopped".into()), ..status() };
        let picture = drawn(&view(), &status, 60, 10);
        assert!(picture[0].starts_with("node 1  stopped  51 frames/s"), "{picture:?}");
        assert!(picture[9].starts_with("the node is stopped"), "{picture:?}");
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
        assert_eq!(row, ["6130h:1", "Pressure", "2.25", "bar", "0.1", "2.25", "3"]);
        let row = screen[3].split_whitespace().collect::<Vec<_>>();
        assert_eq!(row, ["1008h:0", "Name", "node", "-", "-", "1"]);
    }

    #[test]
    fn the_plot_shows_the_window_with_its_unit() {
        let mut view = view();
        for second in 0..100 {
            take(&mut view, second, second as f32);
        }
        let screen = screen(&view, 110, 30).join("\n");
        for label in ["89.0", "94.0", "99.0 s"] {
            assert!(screen.contains(label), "{screen}");
        }
    }

    #[test]
    fn a_new_unit_begins_the_values_of_its_signal_again() {
        let mut view = view();
        take(&mut view, 5, 1.5);
        view.follow(0, &Signal::polled(at(0x6130, 1), "Pressure", "bar"));
        take(&mut view, 6, 2.5);
        view.follow(0, &Signal::polled(at(0x6130, 1), "Pressure", "kPa"));
        take(&mut view, 7, 250.0);
        let screen = screen(&view, 110, 30);
        let row = screen[2].split_whitespace().collect::<Vec<_>>();
        assert_eq!(row, ["6130h:1", "Pressure", "250", "kPa", "250", "250", "1"]);
    }

    #[test]
    fn a_paused_plot_does_not_change() {
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
        let mut empty = View::new(&[], catalogue(), 10.0);
        empty.choose(1);
        screen(&empty, 80, 25);
    }
}
