//! The TPDOs of one node: CAN-IDs, inhibit time, SYNC and length.

use std::collections::BTreeMap;

use canopen::{Duration, Frame, Instant};

use crate::values::Values;
use crate::{Findings, Rule};

/// Tolerance for the times of frames on a bus, in us: the node queues a frame some time before the bus carries it.
const TOLERANCE: f64 = 500.0;

/// Messages of a TPDO that wait for the bus at most: one in the queue, and one in each of three mailboxes.
const WAITING: u32 = 4;

/// The settings of a TPDO, where known.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    pub(crate) id: u16,
    kind: Option<u8>,
    inhibit: Duration,
}

/// The state of a TPDO since its last frame.
#[derive(Clone, Copy, Debug, Default)]
struct Sent {
    last: Option<Instant>,
    /// The time for which the last frame may have waited for the bus.
    wait: f64,
    /// SYNCs that were not answered yet.
    syncs: u32,
}

/// The times of a frame on the bus.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Times {
    pub(crate) at: Instant,
    /// The start of frame in us.
    pub(crate) start: f64,
    /// The time in us for which the frame may have waited for the bus.
    pub(crate) wait: f64,
    /// Whether frames take time.
    pub(crate) is_real: bool,
    /// The time of a frame in us.
    pub(crate) frame: f64,
}

/// The TPDOs by the index of their communication parameter.
#[derive(Debug, Default)]
pub(crate) struct Pdos {
    sent: BTreeMap<u16, Sent>,
    last_sync: Option<Instant>,
}

/// The settings of a TPDO; `None` if it is off or not known.
pub(crate) fn settings(values: &Values, index: u16) -> Option<Settings> {
    let cob_id = values.number(index, 1).filter(|cob_id| cob_id & 1 << 31 == 0)?;
    let kind = values.sure_number(index, 2).map(|kind| kind as u8);
    let inhibit = Duration::from_inhibit(values.sure_number(index, 3).unwrap_or(0) as u16);
    Some(Settings { id: (cob_id & 0x7FF) as u16, kind, inhibit })
}

/// The TPDO with this CAN-ID.
pub(crate) fn with_id(values: &Values, id: u16) -> Option<(u16, Settings)> {
    let all = values.keys(0x1800, 0x19FF, 1);
    all.filter_map(|index| Some((index, settings(values, index)?))).find(|(_, settings)| settings.id == id)
}

/// Whether the COB-IDs of all TPDOs that the node is known to have are certain.
pub(crate) fn are_known(values: &Values) -> bool {
    values.keys(0x1800, 0x19FF, 1).all(|index| values.sure_number(index, 1).is_some())
}

impl Pdos {
    /// The node restarts, or leaves and enters Operational.
    pub(crate) fn restart(&mut self) {
        self.sent.clear();
    }

    /// A setting of a TPDO was written. A TPDO that becomes valid restarts.
    pub(crate) fn configured(&mut self, index: u16, sub: u8, was_off: bool) {
        if let Some(sent) = self.sent.get_mut(&index) {
            if sub == 1 && was_off {
                sent.last = None;
            }
            if matches!(sub, 1 | 2 | 6) {
                sent.syncs = sent.syncs.max(256);
            }
        }
    }

    pub(crate) fn sync(&mut self, values: &Values, now: Instant) {
        self.last_sync = Some(now);
        for index in values.keys(0x1800, 0x19FF, 1) {
            let every = values.number(index, 2).unwrap_or(1).clamp(1, 240);
            let sent = self.sent.entry(index).or_default();
            sent.syncs = (sent.syncs + 1).min(WAITING * every);
        }
    }

    /// A TPDO was sent.
    pub(crate) fn frame(
        &mut self,
        (index, settings): (u16, Settings),
        values: &Values,
        frame: &Frame,
        times: Times,
        findings: &mut Findings,
    ) {
        let name = format!("TPDO {} ({:03X}h)", index - 0x17FF, settings.id);
        if let Some(len) = mapped_length(values, index).filter(|len| *len != frame.len()) {
            findings.push((Rule::PdoLength, format!("{name} has {} bytes, mapped are {len}", frame.len())));
        }
        let is_synchronous = settings.kind.is_some_and(|kind| kind <= 240);
        let sent = self.sent.entry(index).or_default();
        if is_synchronous {
            let every = u32::from(settings.kind.unwrap_or(1).max(1));
            if sent.syncs < every {
                let text = format!("{name} of type {every} after {} SYNC", sent.syncs);
                findings.push((Rule::Sync, text));
            }
            sent.syncs = sent.syncs.saturating_sub(every);
            let window = values.sure_number(0x1007, 0).filter(|window| *window > 0);
            if let (Some(window), Some(sync)) = (window, self.last_sync)
                && times.is_real
                && times.start > sync.0 as f64 + f64::from(window) + times.frame + TOLERANCE
            {
                let late = times.at.0 - sync.0;
                let text = format!("{name} is sent {late} us after SYNC, 1007h is {window} us");
                findings.push((Rule::Sync, text));
            }
        }
        let is_event_driven = settings.kind.is_some_and(|kind| kind >= 254);
        if let Some(last) = sent.last.filter(|_| is_event_driven) {
            let gap = times.at.0.saturating_sub(last.0);
            let tolerance = if times.is_real { sent.wait + times.frame + TOLERANCE } else { 0.0 };
            if gap as f64 + tolerance < settings.inhibit.0 as f64 {
                let inhibit = settings.inhibit.0;
                findings.push((
                    Rule::Inhibit,
                    format!("{name} after {gap} us, its inhibit time is {inhibit} us"),
                ));
            }
        }
        (sent.last, sent.wait) = (Some(times.at), times.wait);
    }
}

/// The length of a TPDO in bytes by its mapping; `None` if the mapping is not known or multiplexed.
fn mapped_length(values: &Values, index: u16) -> Option<usize> {
    let mapping = index + 0x200;
    let count = values.sure_number(mapping, 0).filter(|count| *count <= 64)? as u8;
    let bits = (1..=count).map(|sub| values.sure_number(mapping, sub).map(|entry| entry & 0xFF));
    let bits: Option<u32> = bits.sum();
    Some(bits?.div_ceil(8) as usize)
}
