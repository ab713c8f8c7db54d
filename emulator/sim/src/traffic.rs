//! The state of the nodes as observed on the bus, without a look into a board's memory.
//!
//! The COB-IDs are those of the pre-defined connection set (CiA 301, 7.3.3).

use std::collections::BTreeMap;
use std::fmt;

use canbus::{Frame, Id};
use serde::Serialize;

/// NMT states with their codes in heartbeats (CiA 301, 7.2.8.3.2.2).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NmtState {
    /// No heartbeat yet, or an undefined code.
    #[default]
    Unknown,
    /// A boot-up message, but no heartbeat since.
    Initialising,
    /// 4
    Stopped,
    /// 5
    Operational,
    /// 127
    PreOperational,
}

impl NmtState {
    fn from_code(code: u8) -> NmtState {
        match code {
            0 => NmtState::Initialising,
            4 => NmtState::Stopped,
            5 => NmtState::Operational,
            127 => NmtState::PreOperational,
            _ => NmtState::Unknown,
        }
    }
}

impl fmt::Display for NmtState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            NmtState::Unknown => "-",
            NmtState::Initialising => "initialising",
            NmtState::Stopped => "stopped",
            NmtState::Operational => "operational",
            NmtState::PreOperational => "pre-operational",
        })
    }
}

/// The observations of one node.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Heard {
    /// The NMT state from the last heartbeat or boot-up message.
    pub state: NmtState,
    /// Number of boot-up messages.
    pub boot_ups: u64,
    /// Number of heartbeats, without boot-up messages.
    pub heartbeats: u64,
    /// Number of TPDOs 1 to 4.
    pub tpdos: u64,
    /// Number of SDO requests and responses.
    pub sdo_frames: u64,
    /// Number of EMCY messages that report an error.
    pub emcys: u64,
    /// Number of all messages from the node: EMCY, TPDO, SDO response, heartbeat.
    pub sent: u64,
    /// The error code of the last EMCY.
    pub last_emcy: Option<u16>,
    /// The first four bytes of the last TPDO 1 as REAL32: the process value of the first channel.
    pub process_value: Option<f32>,
    /// The data of the last TPDO 1.
    #[serde(skip)]
    pub tpdo1: Option<Vec<u8>>,
    /// The unit of the first channel.
    #[serde(skip)]
    pub unit: Unit,
}

/// The unit of the process value of the first channel (6131h:1), as far as the bus has shown it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Unit {
    /// Nothing has changed it.
    #[default]
    Delivered,
    /// The code that was read or written.
    Code(u32),
    /// The unit was changed before the last boot-up, and may be saved or not.
    Unknown,
}

/// The SDO frames of 6131h:1: a download of four bytes, and the response to an upload.
const WRITES_UNIT: [u8; 4] = [0x23, 0x31, 0x61, 1];
const UNIT_IS_WRITTEN: [u8; 4] = [0x60, 0x31, 0x61, 1];
const UNIT_IS_READ: [u8; 4] = [0x43, 0x31, 0x61, 1];

impl Heard {
    fn on_heartbeat(&mut self, data: &[u8]) {
        let &[code] = data else { return };
        // The toggle bit of node guarding is not part of the state.
        self.state = NmtState::from_code(code & 0x7F);
        if code == 0 {
            self.boot_ups += 1;
            if self.unit != Unit::Delivered {
                self.unit = Unit::Unknown;
            }
        } else {
            self.heartbeats += 1;
        }
    }

    fn on_emcy(&mut self, data: &[u8]) {
        let Some(code) = data.first_chunk().map(|code| u16::from_le_bytes(*code)) else { return };
        self.last_emcy = Some(code);
        // 0000h: an error, or the last one, has gone (CiA 301, 7.2.7).
        self.emcys += u64::from(code != 0);
    }

    fn on_tpdo(&mut self, number: u16, data: &[u8]) {
        self.tpdos += 1;
        // A node sends PDOs only when Operational (CiA 301, 7.3.2.2.4).
        self.state = NmtState::Operational;
        if number == 1 {
            self.tpdo1 = Some(data.to_vec());
            self.process_value = data.first_chunk().map(|value| f32::from_le_bytes(*value));
        }
    }
}

/// An observer of the bus.
#[derive(Clone, Debug, Default)]
pub struct Traffic {
    nodes: BTreeMap<u8, Heard>,
    /// Units in downloads that are not acknowledged yet.
    units: BTreeMap<u8, u32>,
}

impl Traffic {
    /// Processes a frame that has ended on the bus. Returns the node if the frame is its boot-up message.
    pub fn on_frame(&mut self, frame: &Frame) -> Option<u8> {
        let Id::Standard(id) = frame.id() else { return None };
        let (function, node) = (id.as_raw() & 0x780, (id.as_raw() & 0x7F) as u8);
        if node == 0 || frame.is_remote() {
            return None;
        }
        match function {
            0x080 => self.sender(node).on_emcy(frame.bytes()),
            0x180 | 0x280 | 0x380 | 0x480 => self.sender(node).on_tpdo(function >> 8, frame.bytes()),
            0x580 => self.on_response(node, frame.bytes()),
            0x600 => self.on_request(node, frame.bytes()),
            0x700 => self.sender(node).on_heartbeat(frame.bytes()),
            _ => {}
        }
        (function == 0x700 && frame.bytes() == [0]).then_some(node)
    }

    fn on_request(&mut self, node: u8, data: &[u8]) {
        self.nodes.entry(node).or_default().sdo_frames += 1;
        if let Some(code) = code(data, WRITES_UNIT) {
            self.units.insert(node, code);
        }
    }

    fn on_response(&mut self, node: u8, data: &[u8]) {
        let written = code(data, UNIT_IS_WRITTEN).and_then(|_| self.units.remove(&node));
        let heard = self.sender(node);
        heard.sdo_frames += 1;
        if let Some(code) = written.or(code(data, UNIT_IS_READ)) {
            heard.unit = Unit::Code(code);
        }
    }

    fn sender(&mut self, node: u8) -> &mut Heard {
        let heard = self.nodes.entry(node).or_default();
        heard.sent += 1;
        heard
    }

    /// The observations of a node.
    pub fn node(&self, node: u8) -> Heard {
        self.nodes.get(&node).cloned().unwrap_or_default()
    }
}

/// The last four bytes of an SDO frame that begins with `head`.
fn code(data: &[u8], head: [u8; 4]) -> Option<u32> {
    let (begin, rest) = data.split_first_chunk()?;
    (*begin == head).then_some(u32::from_le_bytes(*rest.first_chunk()?))
}

#[cfg(test)]
mod tests {
    use canbus::StandardId;

    use super::*;

    fn hear(traffic: &mut Traffic, id: u16, bytes: &[u8]) -> Option<u8> {
        traffic.on_frame(&Frame::data(StandardId::new(id).unwrap(), bytes).unwrap())
    }

    #[test]
    fn every_service_of_a_node_is_counted() {
        let mut traffic = Traffic::default();
        assert_eq!(hear(&mut traffic, 0x705, &[0]), Some(5));
        assert_eq!(traffic.node(5).state, NmtState::Initialising);
        hear(&mut traffic, 0x705, &[127]);
        hear(&mut traffic, 0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
        hear(&mut traffic, 0x585, &[0x43, 0, 0x10, 0, 0x94, 1, 2, 0]);
        hear(&mut traffic, 0x085, &[0x06, 0x50, 1, 0, 0, 0, 0, 0]);
        hear(&mut traffic, 0x085, &[0, 0, 0, 0, 0, 0, 0, 0]);
        hear(&mut traffic, 0x185, &250_000f32.to_le_bytes());
        hear(&mut traffic, 0x285, &[1]);
        let heard = traffic.node(5);
        assert_eq!(heard.state, NmtState::Operational, "who sends PDOs is");
        assert_eq!((heard.boot_ups, heard.heartbeats, heard.tpdos), (1, 1, 2));
        assert_eq!((heard.sdo_frames, heard.emcys, heard.sent), (2, 1, 7));
        assert_eq!((heard.last_emcy, heard.process_value), (Some(0), Some(250_000.0)));
    }

    #[test]
    fn messages_without_a_node_are_ignored() {
        let mut traffic = Traffic::default();
        for (id, bytes) in [(0x000, &[1u8, 5][..]), (0x080, &[]), (0x705, &[]), (0x085, &[1]), (0x7E5, &[4])]
        {
            assert_eq!(hear(&mut traffic, id, bytes), None);
        }
        assert_eq!(traffic.node(5), Heard { sent: 2, ..Heard::default() });
    }

    #[test]
    fn the_unit_is_the_one_that_the_node_has_acknowledged() {
        let mut traffic = Traffic::default();
        hear(&mut traffic, 0x605, &[0x23, 0x31, 0x61, 1, 0, 0, 0x22, 3]);
        assert_eq!(traffic.node(5).unit, Unit::Delivered);
        hear(&mut traffic, 0x585, &[0x60, 0x31, 0x61, 1, 0, 0, 0, 0]);
        assert_eq!(traffic.node(5).unit, Unit::Code(0x0322_0000));
        hear(&mut traffic, 0x705, &[0]);
        assert_eq!(traffic.node(5).unit, Unit::Unknown);
        hear(&mut traffic, 0x585, &[0x43, 0x31, 0x61, 1, 0, 0, 0x4E, 0]);
        assert_eq!(traffic.node(5).unit, Unit::Code(0x004E_0000));
    }
}
