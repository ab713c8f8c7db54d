//! The first line of the screen: the state of the node, where known.

use ratatui::style::Stylize;
use ratatui::text::{Line, Span};

use crate::acquisition::Acquisition;
use crate::heartbeat::words;
use crate::text::visible;

/// A narrower terminal has no room for the whole line.
const NARROW: u16 = 60;

/// The known state of the node.
pub(super) struct Status {
    pub(super) node: u8,
    /// The NMT state.
    pub(super) state: &'static str,
    /// The newest emergency.
    pub(super) emergency: Option<String>,
    /// Frames of all nodes in a second; `None` until they are counted.
    pub(super) rate: Option<u64>,
    /// A reason why values may be missing.
    pub(super) hint: Option<String>,
}

impl Status {
    pub(super) fn of(acquisition: &Acquisition, rate: Option<u64>) -> Status {
        Status {
            node: acquisition.node().get(),
            state: acquisition.state().map_or("no heartbeat yet", words),
            emergency: acquisition.emergency().map(visible),
            rate,
            hint: acquisition.hint().or_else(|| acquisition.awaited()),
        }
    }

    /// `node 1  operational  51 frames/s  EMCY 8130h heartbeat ...`
    /// On a narrow terminal the emergency is more important than the frame rate.
    pub(super) fn line(&self, width: u16) -> Line<'static> {
        let has_room = self.emergency.is_none() || width >= NARROW;
        let rate =
            self.rate.filter(|_| has_room).map(|rate| format!("  {rate} frames/s")).unwrap_or_default();
        let mut spans =
            vec![Span::from(format!("node {}  {}", self.node, self.state)).bold(), Span::from(rate)];
        if let Some(emergency) = &self.emergency {
            let text = format!("  EMCY {emergency}");
            let is_over = emergency.starts_with("0000h");
            spans.push(if is_over { Span::from(text).green() } else { Span::from(text).red() });
        }
        Line::from(spans)
    }
}
