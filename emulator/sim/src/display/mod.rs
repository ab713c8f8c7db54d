//! What the user sees: a live screen on a terminal, plain lines elsewhere, nothing beside JSON.

mod nodes;
mod plain;
mod screen;
mod tpdo;
mod view;

use std::io::{self, IsTerminal};

use canbus::Time;

use crate::console::Command;
use crate::log::Line;
use crate::status::{NodeStatus, Status};
use plain::Plain;
use screen::Screen;

/// One of the three.
pub struct Display(Kind);

enum Kind {
    Screen(Box<Screen>),
    Plain(Plain),
    /// The log goes to the standard error output: the other one is for a program.
    Quiet,
}

impl Display {
    /// Shows `greeting` first: lines that tell what runs and what to type.
    pub fn open(greeting: &[String]) -> io::Result<Display> {
        let interactive = io::stdout().is_terminal() && io::stdin().is_terminal();
        let kind = if interactive {
            Kind::Screen(Box::new(Screen::open(greeting)?))
        } else {
            Kind::Plain(Plain::new(greeting)?)
        };
        Ok(Display(kind))
    }

    /// Shows nothing but the log, which goes to the standard error output.
    pub fn quiet() -> Display {
        Display(Kind::Quiet)
    }

    /// Whether commands are typed on the screen; if not, they come line by line on the standard input.
    pub fn takes_commands(&self) -> bool {
        matches!(self.0, Kind::Screen(_))
    }

    /// Shows a line of a board's log.
    pub fn log(&mut self, line: &Line) -> io::Result<()> {
        match &mut self.0 {
            Kind::Screen(screen) => screen.log(log_line(line)),
            Kind::Plain(plain) => plain.log(line)?,
            Kind::Quiet => eprintln!("{}", log_line(line)),
        }
        Ok(())
    }

    /// Tells the user something about a command.
    pub fn say(&mut self, text: String) {
        match &mut self.0 {
            Kind::Screen(screen) => screen.log(text),
            Kind::Plain(_) | Kind::Quiet => eprintln!("{text}"),
        }
    }

    /// Shows the state of the nodes when it is time to, and returns what the user has typed.
    pub fn update(&mut self, now: Time, status: impl FnOnce() -> Status) -> io::Result<Option<Command>> {
        match &mut self.0 {
            Kind::Screen(screen) => screen.update(status),
            Kind::Plain(plain) => plain.update(now, status).map(|()| None),
            Kind::Quiet => Ok(None),
        }
    }
}

fn log_line(line: &Line) -> String {
    format!("{} node {} {:5} {}", line.at, line.node, format!("{:?}", line.level).to_lowercase(), line.text)
}

/// The board's number, and its node-ID where that is another one.
fn name(node: &NodeStatus) -> String {
    if node.id == node.node_id { node.id.to_string() } else { format!("{} ({})", node.id, node.node_id) }
}

/// A line cut into lines of so many letters.
fn wrapped(line: &str, width: usize) -> Vec<ratatui::text::Line<'static>> {
    let letters: Vec<char> = line.chars().collect();
    letters.chunks(width).map(|part| ratatui::text::Line::from(part.iter().collect::<String>())).collect()
}
