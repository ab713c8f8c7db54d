//! The nodes on the screen: a table if the terminal is wide enough, otherwise as many lines as each node needs.

use ratatui::style::Stylize;
use ratatui::text::{Line, Text};

use crate::status::{NodeRates, NodeStatus, Rates, Status};

/// Titles of the table with their widths; the unit is below the quantity.
const COLUMNS: [(&str, usize); 10] = [
    ("node", 9),
    ("is", 8),
    ("NMT state", 15),
    ("TPDO 1", 16),
    ("EMCY", 5),
    ("p/Pa", 8),
    ("T/K", 7),
    ("turns", 9),
    ("frames/s", 8),
    ("CPU/%", 6),
];
/// Indentation of a node's second and further lines.
const INDENT: &str = "   ";
const NONE: NodeRates = NodeRates { frames: 0.0, cpu_load: 0.0 };

/// All nodes in at most `height` lines of this width; the last line tells how many nodes do not fit.
pub(super) fn text(status: &Status, rates: Option<&Rates>, width: usize, height: usize) -> Text<'static> {
    let of = |index: usize| rates.and_then(|rates| rates.nodes.get(index)).unwrap_or(&NONE);
    let nodes = status.nodes.iter().enumerate().map(|(index, node)| Shown::new(node, of(index)));
    let blocks: Vec<Vec<Line>> = if width < table_width() {
        nodes.map(|node| node.lines(width)).collect()
    } else {
        let head = Line::from(columns(COLUMNS.map(|(title, _)| title.to_owned()))).bold();
        std::iter::once(vec![head]).chain(nodes.map(|node| vec![Line::from(columns(node.cells))])).collect()
    };
    fitting(blocks, height)
}

fn table_width() -> usize {
    COLUMNS.iter().map(|(_, width)| width + 1).sum()
}

fn columns(cells: [String; COLUMNS.len()]) -> String {
    let cells = cells.iter().zip(COLUMNS).map(|(cell, (_, width))| format!("{cell:width$}"));
    cells.collect::<Vec<_>>().join(" ").trim_end().to_owned()
}

/// As many complete nodes as fit.
fn fitting(blocks: Vec<Vec<Line<'static>>>, height: usize) -> Text<'static> {
    let (total, mut shown) = (blocks.len(), Vec::new());
    let all: usize = blocks.iter().map(Vec::len).sum();
    // If not all nodes fit, one line is reserved for the number of missing nodes.
    let room = if all > height { height.saturating_sub(1) } else { height };
    for (fit, block) in blocks.into_iter().enumerate() {
        if shown.len() + block.len() > room {
            let missing = format!("{} more: a larger terminal shows them", total - fit);
            shown.push(Line::from(missing).dim());
            break;
        }
        shown.extend(block);
    }
    Text::from(shown)
}

/// A node as text.
struct Shown {
    cells: [String; COLUMNS.len()],
    /// The values with their units.
    words: Vec<String>,
}

impl Shown {
    fn new(node: &NodeStatus, rates: &NodeRates) -> Shown {
        let emcy = node.heard.last_emcy.filter(|code| *code != 0);
        let cells = [
            super::name(node),
            node.personality.to_string(),
            node.heard.state.to_string(),
            super::tpdo::value(node),
            emcy.map_or_else(|| "-".to_owned(), |code| format!("{code:04X}h")),
            format!("{:.0}", node.pressure),
            format!("{:.2}", node.temperature),
            format!("{:.3}", node.position),
            format!("{:.1}", rates.frames),
            format!("{:.2}", rates.cpu_load * 100.0),
        ];
        let [name, is, state, tpdo, emcy, pressure, temperature, turns, frames, cpu] = &cells;
        let mut words = vec![format!("{name:2} {is} {state}"), tpdo.clone()];
        if emcy != "-" {
            words.push(format!("EMCY {emcy}"));
        }
        words.extend([format!("{pressure} Pa"), format!("{temperature} K"), format!("{turns} turns")]);
        words.extend([format!("{frames} frames/s"), format!("CPU {cpu} %")]);
        Shown { cells, words }
    }

    /// The words in as few lines as possible; a word is only broken if it is longer than a line.
    fn lines(&self, width: usize) -> Vec<Line<'static>> {
        let mut lines = vec![String::new()];
        for word in &self.words {
            let last = lines.last_mut().expect("there is one from the start");
            let gap = if last.trim().is_empty() { "" } else { "  " };
            if last.chars().count() + gap.len() + word.chars().count() <= width || last.is_empty() {
                last.push_str(gap);
                last.push_str(word);
            } else {
                lines.push(format!("{INDENT}{word}"));
            }
        }
        lines.iter().flat_map(|line| super::wrapped(line, width.max(1))).collect()
    }
}
