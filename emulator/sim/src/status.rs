//! The state of the simulation at one instant, for display.

use canbus::Time;

use crate::personality::Personality;
use crate::traffic::Heard;

/// The bus and its nodes.
#[derive(Clone, Debug, Default)]
pub struct Status {
    /// Virtual time.
    pub at: Time,
    /// Time in which the bus was busy, since power-on.
    pub bus_busy: Time,
    /// One for each board, in the order of the command line.
    pub nodes: Vec<NodeStatus>,
}

/// One board.
#[derive(Clone, Debug)]
pub struct NodeStatus {
    /// The board's number on the command line.
    pub id: u8,
    /// The node-ID that the node has booted with.
    pub node_id: u8,
    /// The personality.
    pub personality: Personality,
    /// The state observed on the bus.
    pub heard: Heard,
    /// The pressure at the sensor, in Pa.
    pub pressure: f64,
    /// The temperature of the chip, in K.
    pub temperature: f64,
    /// The position of the shaft, in revolutions.
    pub position: f64,
    /// Time in which the core was awake, since power-on.
    pub awake: Time,
}

/// The rates between two instants.
#[derive(Clone, Debug, PartialEq)]
pub struct Rates {
    /// Bus load, 0 to 1.
    pub bus_load: f64,
    /// One for each board.
    pub nodes: Vec<NodeRates>,
}

/// The rates of one board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NodeRates {
    /// Frames sent per second.
    pub frames: f64,
    /// Share of time in which the core was awake, 0 to 1.
    pub cpu_load: f64,
}

impl Status {
    /// The rates since `earlier`; all zero when no time has passed.
    pub fn rates(&self, earlier: &Status) -> Rates {
        let span = self.at.since(earlier.at);
        let nodes = self.nodes.iter().enumerate().map(|(index, node)| {
            let before = earlier.nodes.get(index);
            let sent = node.heard.sent.saturating_sub(before.map_or(0, |node| node.heard.sent));
            let awake = node.awake.since(before.map_or(Time::ZERO, |node| node.awake));
            NodeRates { frames: per_second(sent, span), cpu_load: share(awake, span) }
        });
        Rates { bus_load: share(self.bus_busy.since(earlier.bus_busy), span), nodes: nodes.collect() }
    }
}

/// The ratio of `part` to `whole`, 0 to 1.
pub(crate) fn share(part: Time, whole: Time) -> f64 {
    if whole == Time::ZERO { 0.0 } else { part.as_secs_f64() / whole.as_secs_f64() }
}

/// The number of events per second, for `count` events in `span`.
#[allow(clippy::cast_precision_loss)]
pub(crate) fn per_second(count: u64, span: Time) -> f64 {
    if span == Time::ZERO { 0.0 } else { count as f64 / span.as_secs_f64() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(at: u64, bus_busy: u64, sent: u64, awake: u64) -> Status {
        let node = NodeStatus {
            id: 1,
            node_id: 1,
            personality: Personality::Pressure,
            heard: Heard { sent, ..Heard::default() },
            pressure: 0.0,
            temperature: 0.0,
            position: 0.0,
            awake: Time::from_millis(awake),
        };
        Status { at: Time::from_millis(at), bus_busy: Time::from_millis(bus_busy), nodes: vec![node] }
    }

    #[test]
    fn rates_are_those_of_the_span_between() {
        let rates = status(3000, 150, 25, 700).rates(&status(1000, 50, 5, 100));
        assert_eq!(rates, Rates { bus_load: 0.05, nodes: vec![NodeRates { frames: 10.0, cpu_load: 0.3 }] });
    }

    #[test]
    fn no_time_no_rates() {
        let now = status(1000, 50, 5, 100);
        let nothing = Rates { bus_load: 0.0, nodes: vec![NodeRates { frames: 0.0, cpu_load: 0.0 }] };
        assert_eq!(now.rates(&now), nothing);
        assert_eq!(status(0, 0, 0, 0).rates(&Status::default()), nothing);
    }
}
