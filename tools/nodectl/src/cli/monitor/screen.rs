//! The terminal: draws the view and reads the keys.

use std::io;
use std::time::Duration;

use canopen::Instant;
use crossterm::event::{self, Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers};
use ratatui::DefaultTerminal;

use super::status::Status;
use super::view::View;
use crate::acquisition::Acquisition;
use crate::cli::Failure;

/// The period of drawing the screen.
const REFRESH: canopen::Duration = canopen::Duration::from_millis(100);

/// A second in microseconds: the time over which frames are counted.
const SECOND: u64 = 1_000_000;

/// The terminal, restored when the value is dropped.
struct Terminal(DefaultTerminal);

impl Drop for Terminal {
    fn drop(&mut self) {
        ratatui::restore();
    }
}

/// Shows values until `q` is pressed, or until `count` values have come.
pub(super) fn run(
    acquisition: &mut Acquisition,
    mut view: View,
    count: Option<usize>,
) -> Result<(), Failure> {
    let mut terminal = Terminal(ratatui::try_init()?);
    let mut left = count.unwrap_or(usize::MAX);
    let (mut rate, mut counted) = (None, (acquisition.now(), 0));
    while left > 0 {
        let due = acquisition.now() + REFRESH;
        left = left.saturating_sub(acquire(acquisition, &mut view, due, left)?);
        let (since, frames) = counted;
        let passed = acquisition.now().0.saturating_sub(since.0);
        if passed >= SECOND {
            rate = Some((acquisition.frames() - frames) * SECOND / passed);
            counted = (acquisition.now(), acquisition.frames());
        }
        let status = Status::of(acquisition, rate);
        terminal.0.draw(|frame| view.draw(frame, &status))?;
        if is_over(&mut view)? {
            break;
        }
    }
    Ok(())
}

/// Takes up to `most` values until an instant. Returns the number of values.
fn acquire(
    acquisition: &mut Acquisition,
    view: &mut View,
    until: Instant,
    most: usize,
) -> Result<usize, Failure> {
    let mut taken = 0;
    while taken < most && acquisition.now() < until {
        if let Some(sample) = acquisition.next(until)? {
            view.follow(sample.signal, &acquisition.signals()[sample.signal]);
            view.take(&sample);
            taken += 1;
        }
    }
    Ok(taken)
}

/// Handles the keys. Returns whether one of them ends the program.
fn is_over(view: &mut View) -> io::Result<bool> {
    while event::poll(Duration::ZERO)? {
        if let Event::Key(key) = event::read()?
            && key.kind != KeyEventKind::Release
            && on_key(key, view)
        {
            return Ok(true);
        }
    }
    Ok(false)
}

fn on_key(key: KeyEvent, view: &mut View) -> bool {
    match key.code {
        KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return true,
        KeyCode::Char('q') | KeyCode::Esc => return true,
        KeyCode::Up => view.choose(-1),
        KeyCode::Down => view.choose(1),
        KeyCode::Char(' ') => view.hold(),
        KeyCode::Char('+' | '=') => view.zoom(true),
        KeyCode::Char('-') => view.zoom(false),
        KeyCode::Char('?' | 'h') => view.help(),
        _ => (),
    }
    false
}
