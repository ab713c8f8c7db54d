//! `nodectl trace --by-id`: the frames of each CAN-ID, counted, and the load of the bus.

use std::collections::BTreeMap;
use std::fmt;

use canopen::Instant;
use serde::Serialize;

use super::load::{self, Peak};
use crate::text::hex_digits;
use crate::trace::{Kind, Line};

/// The frames of all CAN-IDs.
#[derive(Default)]
pub(super) struct ByCanId {
    rows: BTreeMap<u32, Counted>,
    first: Option<Instant>,
    last: Instant,
    bits: u64,
    peak: Peak,
}

/// The frames of a CAN-ID.
struct Counted {
    kind: Kind,
    node: Option<u8>,
    count: u64,
    first: Instant,
    last: Instant,
    shortest: u64,
    longest: u64,
    data: Vec<u8>,
}

/// A CAN-ID in the result. Times in ms.
#[derive(Serialize)]
pub(super) struct Row {
    can_id: u32,
    kind: Kind,
    node: Option<u8>,
    count: u64,
    period: Option<f64>,
    shortest: Option<f64>,
    longest: Option<f64>,
    length: usize,
    data: String,
}

/// The bus in the result.
#[derive(Serialize)]
pub(super) struct Bus {
    frames: u64,
    seconds: f64,
    load_percent: f64,
    peak_percent: f64,
}

#[allow(clippy::cast_precision_loss)] // Far below 2^52 microseconds.
fn milliseconds(micros: u64) -> f64 {
    micros as f64 / 1000.0
}

impl ByCanId {
    /// Counts a frame of this service and node.
    pub(super) fn add(&mut self, id: u32, kind: Kind, node: Option<u8>, data: &[u8], at: Instant) {
        self.first.get_or_insert(at);
        self.last = self.last.max(at);
        let bits = load::bits(data.len());
        self.bits += bits;
        self.peak.add(bits, milliseconds(at.0) / 1000.0);
        let row = self.rows.entry(id).or_insert_with(|| Counted {
            kind,
            node,
            count: 0,
            first: at,
            last: at,
            shortest: u64::MAX,
            longest: 0,
            data: Vec::new(),
        });
        if row.count > 0 {
            let gap = at.0.saturating_sub(row.last.0);
            (row.shortest, row.longest) = (row.shortest.min(gap), row.longest.max(gap));
        }
        row.count += 1;
        row.last = at;
        row.data = data.to_vec();
    }

    /// The rows by CAN-ID.
    pub(super) fn rows(&self) -> impl Iterator<Item = Row> {
        self.rows.iter().map(|(id, row)| {
            let has_gaps = row.count > 1;
            let whole = row.last.0.saturating_sub(row.first.0);
            Row {
                can_id: *id,
                kind: row.kind,
                node: row.node,
                count: row.count,
                period: has_gaps.then(|| milliseconds(whole / (row.count - 1).max(1))),
                shortest: has_gaps.then(|| milliseconds(row.shortest)),
                longest: has_gaps.then(|| milliseconds(row.longest)),
                length: row.data.len(),
                data: hex_digits(&row.data, " "),
            }
        })
    }

    /// The load at this bit rate in kbit/s, in all and in the busiest tenth of a second.
    #[allow(clippy::cast_precision_loss)]
    pub(super) fn bus(&self, bit_rate: u16) -> Bus {
        let micros = self.first.map_or(0, |first| self.last.0.saturating_sub(first.0));
        let seconds = milliseconds(micros) / 1000.0;
        let percent = |bits: u64, seconds: f64| {
            let room = seconds * f64::from(bit_rate) * 1000.0;
            if room == 0.0 { 0.0 } else { 100.0 * bits as f64 / room }
        };
        let load_percent = percent(self.bits, seconds);
        let busiest = percent(self.peak.most(), load::WINDOW.min(seconds));
        Bus {
            frames: self.rows.values().map(|row| row.count).sum(),
            seconds,
            load_percent,
            // The average counts a frame at both ends, which no window of a short trace has.
            peak_percent: busiest.max(load_percent),
        }
    }
}

/// The head of the table.
pub(super) const HEAD: &str =
    "CAN-ID service   node    count  period ms  shortest    longest  bytes  newest data";

/// `181h pdo          1      250     20.004    19.870     20.120      8  00 11`
impl fmt::Display for Row {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Row { can_id, kind, node, count, period, shortest, longest, length, data } = self;
        let node = node.map_or_else(|| "-".to_owned(), |node| node.to_string());
        let time = |time: &Option<f64>| time.map_or_else(|| "-".to_owned(), |time| format!("{time:.3}"));
        write!(
            f,
            "{can_id:>5X}h {:<9} {node:>4} {count:>8} {:>10} {:>9} {:>10} {length:>6}  {data}",
            kind.name(),
            time(period),
            time(shortest),
            time(longest),
        )
    }
}

impl fmt::Display for Bus {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Bus { frames, seconds, load_percent, peak_percent } = self;
        write!(
            f,
            "{frames} frames in {seconds:.3} s, load {load_percent:.1} %, peak {peak_percent:.1} % (in 0.1 s)"
        )
    }
}

/// The service and the node of a frame, by its line; those of a part of a transfer are those of its CAN-ID.
pub(super) fn service(id: u16, lines: &[Line]) -> (Kind, Option<u8>) {
    let of_line = lines.iter().find(|line| line.id == u32::from(id));
    let node = u8::try_from(id & 0x7F).ok().filter(|node| *node > 0);
    match of_line {
        Some(line) => (line.kind, line.node.map(canopen::NodeId::get)),
        None if (0x580..0x680).contains(&id) => (Kind::Sdo, node),
        None if (0x701..0x780).contains(&id) => (Kind::Heartbeat, node),
        None => (Kind::Other, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn periods_and_their_spread_are_those_of_the_frames() {
        let mut all = ByCanId::default();
        for at in [0, 10_000, 21_000, 30_000] {
            all.add(0x181, Kind::Pdo, Some(1), &[1; 8], Instant(at));
        }
        all.add(0x701, Kind::Heartbeat, Some(1), &[5], Instant(100_000));
        let rows: Vec<Row> = all.rows().collect();
        assert_eq!((rows[0].can_id, rows[0].count, rows[0].period), (0x181, 4, Some(10.0)));
        assert_eq!((rows[0].shortest, rows[0].longest), (Some(9.0), Some(11.0)));
        assert_eq!((rows[1].count, rows[1].period), (1, None));
        let bus = all.bus(250);
        // 4 frames of 117 bits and one of 57 in 25,000 bits.
        assert_eq!((bus.frames, format!("{:.2}", bus.load_percent)), (5, "2.10".to_owned()));
        // No window of 0.1 s has all five, and yet the busiest one is not below the average.
        assert_eq!(format!("{:.2}", bus.peak_percent), "2.10");
    }

    /// Two logs in one file, the older one last, have such frames.
    #[test]
    fn a_frame_may_be_older_than_the_one_before() {
        let mut all = ByCanId::default();
        for at in [50_000, 10_000] {
            all.add(0x181, Kind::Pdo, Some(1), &[1], Instant(at));
        }
        let rows: Vec<Row> = all.rows().collect();
        assert_eq!((rows[0].count, rows[0].period), (2, Some(0.0)));
        assert_eq!(all.bus(250).frames, 2);
    }
}
