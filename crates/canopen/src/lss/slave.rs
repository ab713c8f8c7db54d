//! The LSS slave: selects the requests for this device, and decides on the reaction.

use super::fastscan::{Fastscan, Step};
use super::{BitRate, Bound, Part, request, response, word};
use crate::{NodeId, Span};

/// Node-ID and bit rate that take effect later: with the next reset communication, activation or start.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Configuration {
    /// `None` for a device that waits for a node-ID.
    pub node_id: Option<NodeId>,
    /// The bit rate.
    pub bit_rate: BitRate,
}

/// The reaction of the device to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Outcome {
    /// No response.
    Silence,
    /// A response: its command specifier and its value.
    Answer(u8, u32),
    /// A device without a node-ID has received one: it boots up.
    BootUp,
    /// The bit rate changes.
    Switch(Switch),
    /// Store the configuration; the response is sent when this is done.
    Store(Configuration),
}

/// A change of the bit rate. Nothing is sent for `delay` before the change and for `delay` after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Switch {
    pub(crate) bit_rate: BitRate,
    /// In ms.
    delay: u16,
}

impl Switch {
    pub(crate) fn delay(self) -> Span {
        Span::from_millis(self.delay)
    }
}

/// The LSS slave of a device.
#[derive(Debug)]
pub(crate) struct Slave {
    /// `true` in the configuration state, `false` in the waiting state.
    is_selected: bool,
    pending: Configuration,
    /// How many of the four messages of a selection have matched.
    selected: u8,
    /// How many of the six messages of an identification have matched.
    identified: u8,
    scan: Fastscan,
}

const OK: u8 = 0;
/// A value out of range, or a service that is not supported.
const REFUSED: u8 = 1;
/// The non-volatile memory has failed.
const MEMORY: u8 = 2;

impl Slave {
    pub(crate) fn new(pending: Configuration) -> Slave {
        Slave { is_selected: false, pending, selected: 0, identified: 0, scan: Fastscan::default() }
    }

    /// The configuration that the next reset communication activates.
    pub(crate) fn pending(&self) -> Configuration {
        self.pending
    }

    /// Sets the configuration that the next reset communication activates.
    pub(crate) fn set_pending(&mut self, pending: Configuration) {
        self.pending = pending;
    }

    /// Whether the slave is in the configuration state.
    pub(crate) fn is_selected(&self) -> bool {
        self.is_selected
    }

    /// After a reset of any kind: back to the waiting state.
    pub(crate) fn reset(&mut self) {
        *self = Slave::new(self.pending);
    }

    /// Takes a request: a frame that [`Request::parse`](super::Request::parse) would accept. `node_id` is the node-ID in
    /// use, `identity` gives a part of the identity.
    // The commands are matched here, and not first converted to a request: it takes half of the code.
    pub(crate) fn take(
        &mut self,
        frame: [u8; 8],
        identity: impl Fn(u8) -> u32,
        node_id: Option<NodeId>,
    ) -> Outcome {
        let [command, first, second, ..] = frame;
        let value = word(frame);
        match command {
            request::SWITCH_GLOBAL if first <= 1 => self.switch(first == 1, node_id),
            request::SELECT..=0x43 => {
                let part = command - request::SELECT;
                self.select(part, value == identity(part))
            }
            request::IDENTIFY..=0x4B => {
                let bound = command - request::IDENTIFY;
                self.identify(bound, is_within(bound, value, identity(part_of(bound))))
            }
            request::IDENTIFY_UNCONFIGURED if self.is_unconfigured(node_id) => {
                Outcome::Answer(response::UNCONFIGURED, 0)
            }
            request::FASTSCAN if !self.is_selected && self.is_unconfigured(node_id) => {
                self.fastscan(frame, identity)
            }
            _ if !self.is_selected => Outcome::Silence,
            request::NODE_ID => Outcome::Answer(command, self.set_node_id(first).into()),
            request::BIT_TIMING => Outcome::Answer(command, self.set_bit_rate(first, second).into()),
            request::ACTIVATE => Outcome::Switch(Switch {
                bit_rate: self.pending.bit_rate,
                delay: u16::from_le_bytes([first, second]),
            }),
            request::STORE => Outcome::Store(self.pending),
            request::INQUIRE..=0x5D => Outcome::Answer(command, identity(command - request::INQUIRE)),
            request::INQUIRE_NODE_ID => Outcome::Answer(command, node_id.map_or(u8::MAX, NodeId::get).into()),
            _ => Outcome::Silence,
        }
    }

    /// The response after an attempt to store the configuration.
    pub(crate) fn stored(good: bool) -> (u8, u32) {
        (request::STORE, if good { OK } else { MEMORY }.into())
    }

    /// Switches the state. A device that has received its first node-ID uses it when the master switches back to
    /// waiting.
    fn switch(&mut self, configuration: bool, node_id: Option<NodeId>) -> Outcome {
        let is_left = core::mem::replace(&mut self.is_selected, configuration) && !configuration;
        (self.selected, self.identified) = (0, 0);
        let boots_up = is_left && node_id.is_none() && self.pending.node_id.is_some();
        if boots_up { Outcome::BootUp } else { Outcome::Silence }
    }

    fn select(&mut self, part: u8, matches: bool) -> Outcome {
        if !advance(&mut self.selected, part, matches && !self.is_selected, Part::ALL.len()) {
            return Outcome::Silence;
        }
        self.is_selected = true;
        Outcome::Answer(response::SELECTED, 0)
    }

    fn identify(&mut self, bound: u8, matches: bool) -> Outcome {
        if !advance(&mut self.identified, bound, matches, Bound::ALL.len()) {
            return Outcome::Silence;
        }
        Outcome::Answer(response::IDENTIFIED, 0)
    }

    fn is_unconfigured(&self, node_id: Option<NodeId>) -> bool {
        node_id.is_none() && self.pending.node_id.is_none()
    }

    /// A slave that has been found already takes no part in the scan.
    fn fastscan(&mut self, frame: [u8; 8], identity: impl Fn(u8) -> u32) -> Outcome {
        let step = self.scan.step(frame, identity);
        self.is_selected = step == Step::Found;
        if step == Step::Silent { Outcome::Silence } else { Outcome::Answer(response::IDENTIFIED, 0) }
    }

    fn set_node_id(&mut self, id: u8) -> u8 {
        let node_id = NodeId::new(id);
        if node_id.is_none() && id != u8::MAX {
            return REFUSED;
        }
        self.pending.node_id = node_id;
        OK
    }

    fn set_bit_rate(&mut self, table: u8, index: u8) -> u8 {
        let Some(bit_rate) = BitRate::from_index(index).filter(|_| table == 0) else { return REFUSED };
        self.pending.bit_rate = bit_rate;
        OK
    }
}

/// The part of the identity to which a bound belongs. The bounds have the order of [`Bound::ALL`].
fn part_of(bound: u8) -> u8 {
    if bound < 2 { bound } else { bound / 2 + 1 }
}

/// Whether a value is the own vendor-ID or product code, or a bound of the revision or the serial number that includes
/// the own one.
fn is_within(bound: u8, value: u32, own: u32) -> bool {
    match bound {
        0 | 1 => value == own,
        2 | 4 => value <= own,
        _ => value >= own,
    }
}

/// Counts the messages of a series. Each must arrive in order and match; the first message always restarts the series.
/// Returns whether the series is complete.
#[inline(never)] // Two callers.
fn advance(done: &mut u8, number: u8, matches: bool, all: usize) -> bool {
    let is_in_turn = number == 0 || number == *done;
    let next = if is_in_turn && matches { number.saturating_add(1) } else { 0 };
    let is_complete = usize::from(next) == all;
    *done = if is_complete { 0 } else { next };
    is_complete
}
