//! The live screen on a terminal.

use std::io;
use std::time::{Duration, Instant};

use crossterm::event::{self, Event};
use ratatui::DefaultTerminal;

use super::view::View;
use crate::console::Command;
use crate::status::Status;

/// Period of drawing and of reading keys, in the host's time.
const REFRESH: Duration = Duration::from_millis(100);
/// Period over which rates are averaged, in the host's time.
const AVERAGE: Duration = Duration::from_secs(1);

/// The terminal and its content.
pub(super) struct Screen {
    terminal: DefaultTerminal,
    view: View,
    drawn: Instant,
    averaged: Instant,
}

impl Screen {
    /// Takes over the terminal; it is restored when the value is dropped.
    pub(super) fn open(greeting: &[String]) -> io::Result<Screen> {
        let view = View::new(greeting);
        let now = Instant::now();
        Ok(Screen {
            terminal: ratatui::try_init()?,
            view,
            drawn: now.checked_sub(REFRESH).unwrap_or(now),
            averaged: now,
        })
    }

    pub(super) fn log(&mut self, line: String) {
        self.view.log(line);
    }

    /// Draws and reads keys when an update is due; only then `status` is called.
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

    /// Reads the keys typed so far, up to the first complete command.
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
