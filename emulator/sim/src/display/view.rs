//! The content of the live screen: heading, nodes, log, and a line for commands.

use std::collections::VecDeque;
use std::time::Duration;

use crossterm::event::{KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::Frame;
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::Stylize;
use ratatui::text::{Line, Text};
use ratatui::widgets::{Block, Paragraph};

use super::nodes;
use crate::console::{self, Command};
use crate::status::{Rates, Status};

/// Maximum number of stored log lines.
const LOG_LINES: usize = 500;
/// The number of log lines for which space is kept when the greeting is shown.
const LEAST_LOG: usize = 5;
/// The minimum number of lines for borders around the parts.
const WITH_BORDERS: u16 = 18;
/// The keys, shown while the command line is empty.
const KEYS: &str = "? help  q quit";
/// The help text of `?`. No line is longer than the width of the narrowest terminal that shows everything.
const HELP: [&str; 7] = [
    "pressure, temperature, thermistor,",
    "supply, shaft, button, fault [ID=]SPEC",
    "  pressure 1=sine:250000,100000,0.1",
    "  fault open-sensor@2",
    "quit, q, Ctrl-C: ends with a summary",
    "Enter does, Esc clears, ? goes back",
    "nodectl monitor, trace: more to see",
];

/// The content of the screen.
#[derive(Default)]
pub(super) struct View {
    pub(super) greeting: Vec<String>,
    pub(super) status: Status,
    pub(super) log: VecDeque<String>,
    earlier: Status,
    rates: Option<Rates>,
    speed: f64,
    input: String,
    has_help: bool,
}

impl View {
    pub(super) fn new(greeting: &[String]) -> View {
        View { greeting: greeting.to_vec(), ..View::default() }
    }

    pub(super) fn log(&mut self, line: String) {
        if self.log.len() == LOG_LINES {
            self.log.pop_front();
        }
        self.log.push_back(line);
    }

    /// Computes the rates since the last call, `span` of the host's time ago.
    pub(super) fn average(&mut self, span: Duration) {
        self.speed = self.status.at.since(self.earlier.at).as_secs_f64() / span.as_secs_f64();
        self.rates = Some(self.status.rates(&self.earlier));
        self.earlier = self.status.clone();
    }

    pub(super) fn on_key(&mut self, key: KeyEvent) -> Option<Command> {
        match key.code {
            _ if key.kind == KeyEventKind::Release => None,
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => Some(Command::Quit),
            KeyCode::Char('q') if self.input.is_empty() => Some(Command::Quit),
            KeyCode::Char('?') if self.input.is_empty() => {
                self.has_help = !self.has_help;
                None
            }
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
        let command = console::parse(&line, &[])?;
        self.log(format!("> {line}"));
        command.map_err(|error| self.log(error)).ok()
    }

    pub(super) fn draw(&self, frame: &mut Frame) {
        let area = frame.area();
        let border = if area.height < WITH_BORDERS { 0 } else { 2 };
        let width = usize::from(area.width).saturating_sub(border);
        // Lines that are always present: the heading, one line of the log, the command line.
        let room = usize::from(area.height).saturating_sub(3 + 2 * border);
        let nodes = nodes::text(&self.status, self.rates.as_ref(), width, room);
        let is_roomy = room >= nodes.lines.len() + self.greeting.len() + LEAST_LOG;
        let greeting = if is_roomy && !self.has_help { self.greeting.len() } else { 0 };
        let middle = if self.has_help { 0 } else { nodes.lines.len() + border };
        let rows = |count: usize| Constraint::Length(u16::try_from(count).unwrap_or(u16::MAX));
        let areas = [rows(1 + greeting), rows(middle), Constraint::Min(1), rows(1)];
        let [heading, middle, rest, input] = Layout::vertical(areas).areas(area);
        frame.render_widget(self.heading(greeting), heading);
        frame.render_widget(self.input_line(), input);
        if self.has_help {
            return frame.render_widget(framed(HELP.map(Line::from).to_vec(), " help ", border), rest);
        }
        frame.render_widget(framed(nodes, " nodes ", border), middle);
        frame.render_widget(framed(self.log_lines(rest, border), " log ", border), rest);
    }

    fn heading(&self, greeting: usize) -> Paragraph<'_> {
        let load = self.rates.as_ref().map_or(0.0, |rates| rates.bus_load * 100.0);
        let seconds = self.status.at.as_secs_f64();
        let now = format!("{seconds:.3} s, {:.2} x real time, bus {load:.1} %", self.speed);
        let lines = self.greeting.iter().take(greeting).map(|line| Line::from(line.as_str()).dim());
        Paragraph::new(std::iter::once(Line::from(now).bold()).chain(lines).collect::<Vec<_>>())
    }

    fn input_line(&self) -> Line<'_> {
        let keys = if self.input.is_empty() { KEYS } else { "Enter does, Esc clears" };
        Line::from(vec![format!("> {}_  ", self.input).into(), keys.dim()])
    }

    /// As many of the last lines as fit; a long line is wrapped.
    fn log_lines(&self, area: Rect, border: usize) -> Vec<Line<'static>> {
        let inside = |length: u16| usize::from(length).saturating_sub(border);
        let (room, width) = (inside(area.height), inside(area.width).max(1));
        let lines: Vec<Line> = self.log.iter().flat_map(|line| super::wrapped(line, width)).collect();
        lines[lines.len().saturating_sub(room)..].to_vec()
    }
}

fn framed<'a>(text: impl Into<Text<'a>>, title: &'a str, border: usize) -> Paragraph<'a> {
    let text = Paragraph::new(text);
    if border > 0 { text.block(Block::bordered().title(title)) } else { text }
}

#[cfg(test)]
mod tests {
    use canbus::Time;
    use ratatui::Terminal;
    use ratatui::backend::TestBackend;
    use ratatui::buffer::Cell;

    use super::*;
    use crate::personality::Personality;
    use crate::status::NodeStatus;
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

    fn drawn(view: &View, width: u16, height: u16) -> String {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| view.draw(frame)).unwrap();
        let lines = terminal.backend().buffer().content().chunks(width.into());
        let text = |cells: &[Cell]| cells.iter().map(Cell::symbol).collect::<String>();
        lines.map(|cells| format!("{}\n", text(cells).trim_end())).collect()
    }

    /// A view of two nodes after a second, one of them with an error.
    fn two() -> View {
        let mut view = view();
        let mut second = view.status.nodes[0].clone();
        second.heard = Heard {
            state: NmtState::PreOperational,
            tpdo1: Some(4782_u32.to_le_bytes().to_vec()),
            last_emcy: Some(0x6101),
            ..Heard::default()
        };
        (second.id, second.node_id, second.personality) = (12, 120, Personality::Encoder);
        view.status.nodes.push(second);
        view.log(
            "0.046000 node 5 info  version 0.1.0 on NUCLEO-F446RE, serial 026517c9, reset by power on".into(),
        );
        view.average(Duration::from_secs(1));
        view
    }

    fn press(view: &mut View, keys: &str) -> Option<Command> {
        keys.chars().fold(None, |_, key| {
            let code = if key == '\n' { KeyCode::Enter } else { KeyCode::Char(key) };
            view.on_key(KeyEvent::new(code, KeyModifiers::NONE))
        })
    }

    #[test]
    fn pictures_from_a_small_terminal_to_a_large_one() {
        for (width, height) in [(40, 10), (80, 24), (120, 40)] {
            let picture = drawn(&two(), width, height);
            let path = format!("{}/tests/screens/sim-{width}x{height}.txt", env!("CARGO_MANIFEST_DIR"));
            if std::env::var("SCREENS").is_ok_and(|value| value == "write") {
                std::fs::write(&path, &picture).unwrap();
            }
            assert_eq!(picture, std::fs::read_to_string(&path).unwrap(), "{path}");
        }
    }

    #[test]
    fn no_value_no_unit_and_no_key_is_lost_on_any_terminal() {
        for width in (40..200).step_by(3) {
            for height in [10, 24, 60] {
                let screen = drawn(&two(), width, height);
                let mut texts = vec![
                    "5 pressure",
                    "operational",
                    "2.500 bar",
                    "250000",
                    "298.15",
                    "0.250",
                    "6.0",
                    "5.00",
                ];
                texts.extend([
                    "12 (120)",
                    "pre-operational",
                    "4782 units",
                    "6101h",
                    "q quit",
                    "bus 1.0 %",
                    "2.00 x real time",
                ]);
                let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
                for text in texts {
                    assert!(words(&screen).contains(text), "{width}x{height}: {text} in\n{screen}");
                }
            }
        }
    }

    #[test]
    fn a_long_line_of_the_log_is_wrapped() {
        let mut view = view();
        view.log("x".repeat(100) + "end");
        assert!(drawn(&view, 80, 24).contains("xend"));
    }

    #[test]
    fn nodes_without_room_are_counted() {
        let mut view = two();
        let node = view.status.nodes[0].clone();
        view.status.nodes.extend(std::iter::repeat_n(node, 20));
        assert!(drawn(&view, 40, 10).contains("21 more"));
        assert!(!drawn(&view, 200, 60).contains("more"));
    }

    #[test]
    fn a_screen_that_is_too_small_is_drawn_too() {
        for (width, height) in [(1, 1), (5, 2), (3, 40), (200, 1)] {
            drawn(&two(), width, height);
        }
    }

    #[test]
    fn help_comes_and_goes_by_its_key() {
        let mut view = two();
        press(&mut view, "?");
        for (width, height) in [(40, 10), (80, 24), (120, 40)] {
            let screen = drawn(&view, width, height);
            assert!(HELP.iter().all(|line| screen.contains(line)), "{screen}");
        }
        press(&mut view, "?");
        assert!(!drawn(&view, 80, 24).contains("nodectl monitor"));
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
