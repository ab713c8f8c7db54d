//! The live screen: heading, nodes, log, and a line to type commands into.

use std::collections::VecDeque;
use std::io;
use std::time::{Duration, Instant};

use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Stylize;
use ratatui::text::Line;
use ratatui::widgets::{Block, Paragraph, Row, Table};
use ratatui::{DefaultTerminal, Frame};

use crate::console::{self, Command};
use crate::status::{NodeRates, NodeStatus, Status};

/// How often the screen is drawn and keys are read, in the host's time.
const REFRESH: Duration = Duration::from_millis(100);
/// Rates are averaged over this time of the host.
const AVERAGE: Duration = Duration::from_secs(1);
/// Lines of the log that are kept.
const LOG_LINES: usize = 500;

/// The terminal and what is on it.
pub(super) struct Screen {
    terminal: DefaultTerminal,
    view: View,
    drawn: Instant,
    averaged: Instant,
}

/// What is on the screen.
#[derive(Default)]
struct View {
    greeting: Vec<String>,
    status: Status,
    earlier: Status,
    rates: Option<crate::status::Rates>,
    speed: f64,
    log: VecDeque<String>,
    input: String,
}

impl Screen {
    /// Takes over the terminal; it is given back when the value is dropped.
    pub(super) fn open(greeting: &[String]) -> io::Result<Screen> {
        let view = View { greeting: greeting.to_vec(), ..View::default() };
        let now = Instant::now();
        Ok(Screen { terminal: ratatui::try_init()?, view, drawn: now - REFRESH, averaged: now })
    }

    pub(super) fn log(&mut self, line: String) {
        self.view.log(line);
    }

    /// Draws and reads keys when it is time to. `status` is only made then.
    pub(super) fn update(&mut self, status: impl FnOnce() -> Status) -> io::Result<Option<Command>> {
        if self.drawn.elapsed() < REFRESH {
            return Ok(None);
        }
        self.drawn = Instant::now();
        self.view.status = status();
        let span = self.averaged.elapsed();
        if span >= AVERAGE {
            self.averaged = self.drawn;
            self.view.average(span);
        }
        self.terminal.draw(|frame| self.view.draw(frame))?;
        self.read_keys()
    }

    /// Everything typed so far, up to the first complete command.
    fn read_keys(&mut self) -> io::Result<Option<Command>> {
        while event::poll(Duration::ZERO)? {
            let Event::Key(key) = event::read()? else { continue };
            if let Some(command) = self.view.on_key(key) {
                return Ok(Some(command));
            }
        }
        Ok(None)
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

impl View {
    fn log(&mut self, line: String) {
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(line);
    }

    /// Rates since the last call, `span` of the host's time ago.
    fn average(&mut self, span: Duration) {
        self.speed = self.status.at.since(self.earlier.at).as_secs_f64() / span.as_secs_f64();
        self.rates = Some(self.status.rates(&self.earlier));
        self.earlier = self.status.clone();
    }

    fn on_key(&mut self, key: KeyEvent) -> Option<Command> {
        match key.code {
            _ if key.kind == KeyEventKind::Release => None,
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Command::Quit),
            KeyCode::Char('q') if self.input.is_empty() => Some(Command::Quit),
            KeyCode::Char(letter) => {
                self.input.push(letter);
                None
            }
            KeyCode::Backspace => self.input.pop().and(None),
            KeyCode::Esc => {
                self.input.clear();
                None
            }
            KeyCode::Enter => self.on_enter(),
            _ => None,
        }
    }

    fn on_enter(&mut self) -> Option<Command> {
        let line = std::mem::take(&mut self.input);
        let command = console::parse(&line)?;
        self.log(format!("> {line}"));
        command.map_err(|error| self.log(error)).ok()
    }

    fn draw(&self, frame: &mut Frame) {
        let rows = |count: usize| Constraint::Length(u16::try_from(count).unwrap_or(u16::MAX));
        let areas =
            [rows(self.greeting.len() + 1), rows(self.status.nodes.len() + 3), Constraint::Min(3), rows(1)];
        let [heading, nodes, log, input] = Layout::vertical(areas).areas(frame.area());
        frame.render_widget(self.heading(), heading);
        frame.render_widget(self.nodes(), nodes);
        frame.render_widget(self.log_lines(log), log);
        frame.render_widget(Paragraph::new(format!("> {}_", self.input)), input);
    }

    fn heading(&self) -> Paragraph<'_> {
        let load = self.rates.as_ref().map_or(0.0, |rates| rates.bus_load * 100.0);
        let now = format!("{} s, {:.2} x real time, bus load {load:.1} %", self.status.at, self.speed);
        let lines = self.greeting.iter().map(|line| Line::from(line.as_str()).dim());
        Paragraph::new(std::iter::once(Line::from(now).bold()).chain(lines).collect::<Vec<_>>())
    }

    fn nodes(&self) -> Table<'_> {
        // Quantities over their units, so that the table fits 80 columns.
        let titles = ["node", "is", "NMT state", "TPDO 1", "p/Pa", "T/K", "turns", "frames/s", "CPU/%"];
        let widths = [7, 8, 15, 11, 7, 6, 7, 8, 5].map(Constraint::Max);
        let none = NodeRates { frames: 0.0, cpu_load: 0.0 };
        let rows = self.status.nodes.iter().enumerate().map(|(index, node)| {
            let rates = self.rates.as_ref().and_then(|rates| rates.nodes.get(index));
            row(node, rates.unwrap_or(&none))
        });
        Table::new(rows, widths).header(Row::new(titles).bold()).block(Block::bordered().title(" nodes "))
    }

    /// As many of the last lines as fit; a long one is several.
    fn log_lines(&self, area: Rect) -> Paragraph<'_> {
        let inside = |length: u16| usize::from(length.saturating_sub(2));
        let (room, width) = (inside(area.height), inside(area.width).max(1));
        let lines: Vec<Line> = self.log.iter().flat_map(|line| wrapped(line, width)).collect();
        Paragraph::new(lines[lines.len().saturating_sub(room)..].to_vec())
            .block(Block::bordered().title(" log "))
    }
}

/// A line cut into lines of so many letters.
fn wrapped(line: &str, width: usize) -> Vec<Line<'static>> {
    let letters: Vec<char> = line.chars().collect();
    letters.chunks(width).map(|part| Line::from(part.iter().collect::<String>())).collect()
}

fn row(node: &NodeStatus, rates: &NodeRates) -> Row<'static> {
    Row::new([
        super::name(node),
        node.personality.to_string(),
        node.heard.state.to_string(),
        super::tpdo::value(node),
        format!("{:.0}", node.pressure),
        format!("{:.2}", node.temperature),
        format!("{:.3}", node.position),
        format!("{:.1}", rates.frames),
        format!("{:.2}", rates.cpu_load * 100.0),
    ])
}

#[cfg(test)]
mod tests {
    use canbus::Time;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;

    use super::*;
    use crate::personality::Personality;
    use crate::traffic::{Heard, NmtState};

    fn view() -> View {
        let heard = Heard {
            state: NmtState::Operational,
            tpdo1: Some([2.5_f32.to_le_bytes(), 25.0_f32.to_le_bytes()].concat()),
            sent: 12,
            ..Heard::default()
        };
        let node = NodeStatus {
            id: 5,
            node_id: 5,
            personality: Personality::Pressure,
            heard,
            pressure: 250_000.0,
            temperature: 298.15,
            position: 0.25,
            awake: Time::from_millis(100),
        };
        let status =
            Status { at: Time::from_millis(2000), bus_busy: Time::from_millis(20), nodes: vec![node] };
        View { greeting: vec!["hello".into()], status, ..View::default() }
    }

    fn drawn(view: &View) -> String {
        let mut terminal = Terminal::new(TestBackend::new(80, 14)).unwrap();
        terminal.draw(|frame| view.draw(frame)).unwrap();
        terminal.backend().to_string()
    }

    fn press(view: &mut View, keys: &str) -> Option<Command> {
        keys.chars().fold(None, |_, key| {
            let code = if key == '\n' { KeyCode::Enter } else { KeyCode::Char(key) };
            view.on_key(KeyEvent::new(code, KeyModifiers::NONE))
        })
    }

    #[test]
    fn the_screen_shows_the_nodes_their_rates_and_the_log() {
        let mut view = view();
        view.log("0.1 node 5 info started".into());
        view.average(Duration::from_secs(1));
        let screen = drawn(&view);
        for text in ["2.00 x real time", "bus load 1.0 %", "hello", "operational", "2.500 bar", "250000"] {
            assert!(screen.contains(text), "{text} in\n{screen}");
        }
        for text in ["298.15", "0.250", "6.0", "5.00", "node 5 info started"] {
            assert!(screen.contains(text), "{text} in\n{screen}");
        }
    }

    #[test]
    fn eighty_columns_are_enough_for_every_title_and_long_lines_go_on_in_the_next() {
        let mut view = view();
        view.status.nodes[0].node_id = 7;
        view.log("x".repeat(100) + "end");
        let screen = drawn(&view);
        for text in ["NMT state", "TPDO 1", "p/Pa", "T/K", "turns", "frames/s", "CPU/%", "5 (7)", "xend"] {
            assert!(screen.contains(text), "{text} in\n{screen}");
        }
    }

    #[test]
    fn a_screen_that_is_too_small_is_drawn_too() {
        let mut terminal = Terminal::new(TestBackend::new(5, 2)).unwrap();
        terminal.draw(|frame| view().draw(frame)).unwrap();
    }

    #[test]
    fn commands_are_typed_and_mistakes_are_said() {
        let mut view = view();
        assert!(matches!(press(&mut view, "pressure const:1000\n"), Some(Command::Stimulus(_))));
        assert_eq!(press(&mut view, "fly\n"), None);
        assert!(view.log.back().is_some_and(|line| line.contains("fly")));
        assert_eq!(press(&mut view, "\n"), None);
        assert_eq!(press(&mut view, "q"), Some(Command::Quit));
    }
}
