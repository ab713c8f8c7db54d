//! Plain lines, for an output that is not a terminal.

use std::io::{self, Write};

use canbus::Time;

use super::tpdo;
use crate::log::Line;
use crate::status::Status;

/// Period of the nodes' states, in virtual time.
const PERIOD: Time = Time::from_millis(1000);

/// Writes log lines as they come and the state of the nodes once a virtual second.
pub(super) struct Plain {
    shown: Status,
}

impl Plain {
    pub(super) fn new(greeting: &[String]) -> io::Result<Plain> {
        let mut out = io::stdout().lock();
        greeting.iter().try_for_each(|line| writeln!(out, "{line}"))?;
        out.flush()?;
        Ok(Plain { shown: Status::default() })
    }

    pub(super) fn log(&mut self, line: &Line) -> io::Result<()> {
        writeln!(io::stdout(), "{}", super::log_line(line))
    }

    /// `status` is only called when an update is due.
    pub(super) fn update(&mut self, now: Time, status: impl FnOnce() -> Status) -> io::Result<()> {
        if now.since(self.shown.at) < PERIOD {
            return Ok(());
        }
        let status = status();
        let mut out = io::stdout().lock();
        lines(&status, &self.shown).iter().try_for_each(|line| writeln!(out, "{line}"))?;
        self.shown = status;
        out.flush()
    }
}

/// One line for each node.
fn lines(status: &Status, earlier: &Status) -> Vec<String> {
    let rates = status.rates(earlier);
    let bus = format!("bus {:.1} %", rates.bus_load * 100.0);
    let nodes = status.nodes.iter().zip(&rates.nodes).map(|(node, rate)| {
        let value = tpdo::value(node);
        format!(
            "{} node {} {}: TPDO 1 {} [sensor {:.0} Pa, {:.2} K, {:.4} rev] {:.1} frames/s, {bus}, CPU {:.2} %",
            status.at,
            super::name(node),
            node.heard.state,
            value,
            node.pressure,
            node.temperature,
            node.position,
            rate.frames,
            rate.cpu_load * 100.0
        )
    });
    nodes.collect()
}
