//! The table of the signals. A narrower terminal shows fewer columns; value and unit are left out last.

use ratatui::Frame;
use ratatui::layout::{Constraint, Rect};
use ratatui::style::Stylize;
use ratatui::widgets::{Row, Table};

use super::view::Track;
use crate::object::Place;
use crate::text::visible;

/// A column of the table.
struct Column {
    title: &'static str,
    width: u16,
    cell: fn(&Track) -> String,
}

const fn column(title: &'static str, width: u16, cell: fn(&Track) -> String) -> Column {
    Column { title, width, cell }
}

/// The columns in the order on the screen.
const COLUMNS: [Column; 7] = [
    column("object", 9, |track| Place(track.signal.at).to_string()),
    column("name", 0, name),
    column("value", 12, |track| visible(&track.newest)),
    column("unit", 6, |track| track.signal.unit.clone()),
    column("least", 12, |track| bound(track.least.as_ref())),
    column("greatest", 12, |track| bound(track.greatest.as_ref())),
    column("values", 7, |track| track.count.to_string()),
];

/// The column of the name, which takes the remaining width.
const NAME: usize = 1;
/// The least useful width of the name, and the greatest one.
const SHORTEST: u16 = 8;
const LONGEST: u16 = 40;
/// The order in which columns are added as the width grows.
const ORDER: [usize; 7] = [2, 3, 1, 0, 6, 4, 5];

pub(super) fn draw(frame: &mut Frame, area: Rect, tracks: &[Track], chosen: usize) {
    let shown = shown(area.width);
    let others: u16 = shown.iter().map(|&number| COLUMNS[number].width + 1).sum();
    let name = area.width.saturating_sub(others).clamp(0, LONGEST);
    let width = |number: usize| if number == NAME { name } else { COLUMNS[number].width };
    let widths = shown.iter().map(|&number| Constraint::Length(width(number)));
    let rows = tracks.iter().enumerate().map(|(number, track)| {
        let cells = shown.iter().map(|&column| cut((COLUMNS[column].cell)(track), width(column)));
        let row = Row::new(cells);
        if number == chosen { row.bold() } else { row }
    });
    let titles = Row::new(shown.iter().map(|&number| COLUMNS[number].title)).dim();
    // Scroll so that the chosen signal is visible.
    let room = usize::from(area.height.saturating_sub(1)).max(1);
    let rows = rows.skip((chosen + 1).saturating_sub(room));
    frame.render_widget(Table::new(rows, widths).header(titles), area);
}

/// The columns that fit into a width, in the order on the screen.
fn shown(width: u16) -> Vec<usize> {
    let mut left = width;
    let mut shown = Vec::new();
    for number in ORDER {
        let wanted = if number == NAME { SHORTEST } else { COLUMNS[number].width } + 1;
        if wanted > left && !shown.is_empty() {
            break;
        }
        left = left.saturating_sub(wanted);
        shown.push(number);
    }
    shown.sort_unstable();
    shown
}

/// A text cut to a width; a mark shows where the end of the text is left out.
fn cut(text: String, width: u16) -> String {
    let width = usize::from(width);
    if text.chars().count() <= width {
        return text;
    }
    let mut short: String = text.chars().take(width.saturating_sub(1)).collect();
    short.push('\u{2026}');
    short
}

/// The name, with the meaning of the newest value where it has one.
fn name(track: &Track) -> String {
    let meaning = track.meaning.as_ref().map(|meaning| format!(" [{meaning}]")).unwrap_or_default();
    visible(&format!("{}{meaning}", track.signal.name))
}

fn bound(bound: Option<&(f64, String)>) -> String {
    bound.map_or_else(|| "-".to_owned(), |(_, text)| text.clone())
}
