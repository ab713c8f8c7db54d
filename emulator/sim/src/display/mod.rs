//! The display: a live screen on a terminal, plain lines elsewhere, and no display with JSON output.

mod nodes;
mod plain;
mod screen;
mod tpdo;
mod view;

use std::io::{self, IsTerminal, Write};

use canbus::Time;

use crate::console::Command;
use crate::log::Line;
use crate::status::{NodeStatus, Status};
use plain::Plain;
use screen::Screen;

/// The kind of display in use.
pub struct Display(Kind);

enum Kind {
    Screen(Box<Screen>),
    Plain(Plain),
    /// The log goes to the standard error output, because a program reads the standard output.
    Quiet,
}

impl Display {
    /// Opens the display with `greeting`: lines that state what is running and which commands exist.
    pub fn open(greeting: &[String]) -> io::Result<Display> {
        let interactive = io::stdout().is_terminal() && io::stdin().is_terminal();
        let kind = if interactive {
            Kind::Screen(Box::new(Screen::open(greeting)?))
        } else {
            Kind::Plain(Plain::new(greeting)?)
        };
        Ok(Display(kind))
    }

    /// A display of the log only, on the standard error output.
    pub fn quiet() -> Display {
        Display(Kind::Quiet)
    }

    /// Whether the user types commands on the screen; otherwise commands are lines on the standard input.
    pub fn takes_commands(&self) -> bool {
        matches!(self.0, Kind::Screen(_))
    }

    /// Shows a line of a board's log.
    pub fn log(&mut self, line: &Line) -> io::Result<()> {
        match &mut self.0 {
            Kind::Screen(screen) => screen.log(log_line(line)),
            Kind::Plain(plain) => plain.log(line)?,
            Kind::Quiet => note(&log_line(line)),
        }
        Ok(())
    }

    /// Shows the user a message about a command.
    pub fn say(&mut self, text: String) {
        match &mut self.0 {
            Kind::Screen(screen) => screen.log(text),
            Kind::Plain(_) | Kind::Quiet => note(&text),
        }
    }

    /// Shows the state of the nodes if an update is due, and returns a command that the user has typed.
    pub fn update(&mut self, now: Time, status: impl FnOnce() -> Status) -> io::Result<Option<Command>> {
        match &mut self.0 {
            Kind::Screen(screen) => screen.update(status),
            Kind::Plain(plain) => plain.update(now, status).map(|()| None),
            Kind::Quiet => Ok(None),
        }
    }
}

/// Writes a line to the standard error output. A closed output is no error: `eprintln!` would panic.
fn note(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}

fn log_line(line: &Line) -> String {
    format!("{} node {} {:5} {}", line.at, line.node, format!("{:?}", line.level).to_lowercase(), line.text)
}

/// The board's number, followed by its node-ID if that differs.
fn name(node: &NodeStatus) -> String {
    if node.id == node.node_id { node.id.to_string() } else { format!("{} ({})", node.id, node.node_id) }
}

/// A line wrapped at `width` characters.
fn wrapped(line: &str, width: usize) -> Vec<ratatui::text::Line<'static>> {
    let letters: Vec<char> = line.chars().collect();
    letters.chunks(width).map(|part| ratatui::text::Line::from(part.iter().collect::<String>())).collect()
}
