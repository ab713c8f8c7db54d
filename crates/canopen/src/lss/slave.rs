//! The LSS slave: selects the requests for this device, and decides on the reaction.

use super::fastscan::{Fastscan, Step};
use super::{BitRate, Bound, Identity, Part, Request, Response};
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
    Answer(Response),
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

    /// After a reset of any kind: back to the waiting state.
    pub(crate) fn reset(&mut self) {
        *self = Slave::new(self.pending);
    }

    /// Takes a request. `node_id` is the node-ID in use.
    pub(crate) fn take(&mut self, request: Request, identity: &Identity, node_id: Option<NodeId>) -> Outcome {
        match request {
            Request::SwitchGlobal { configuration } => self.switch(configuration, node_id),
            Request::Select(part, value) => self.select(part, value, identity),
            Request::Identify(bound, value) => self.identify(bound, value, identity),
            Request::IdentifyUnconfigured if self.is_unconfigured(node_id) => {
                Outcome::Answer(Response::Unconfigured)
            }
            Request::Fastscan { value, bit, part, next } if self.is_scanned(node_id) => {
                self.fastscan(identity, value, bit, part, next)
            }
            _ if self.is_selected => self.configure(request, identity, node_id),
            _ => Outcome::Silence,
        }
    }

    /// Takes a request to the selected slave.
    fn configure(&mut self, request: Request, identity: &Identity, node_id: Option<NodeId>) -> Outcome {
        match request {
            Request::NodeId(id) => Outcome::Answer(Response::NodeId(self.set_node_id(id))),
            Request::BitTiming { table, index } => {
                Outcome::Answer(Response::BitTiming(self.set_bit_rate(table, index)))
            }
            Request::Activate { delay } => Outcome::Switch(Switch { bit_rate: self.pending.bit_rate, delay }),
            Request::Store => Outcome::Store(self.pending),
            Request::Inquire(part) => Outcome::Answer(Response::Identity(part, identity.part(part))),
            Request::InquireNodeId => {
                Outcome::Answer(Response::NodeIdIs(node_id.map_or(u8::MAX, NodeId::get)))
            }
            _ => Outcome::Silence,
        }
    }

    /// The response after an attempt to store the configuration.
    pub(crate) fn stored(good: bool) -> Response {
        Response::Stored(if good { OK } else { MEMORY })
    }

    /// Switches the state. A device that has received its first node-ID uses it when the master switches back to
    /// waiting.
    fn switch(&mut self, configuration: bool, node_id: Option<NodeId>) -> Outcome {
        let is_left = core::mem::replace(&mut self.is_selected, configuration) && !configuration;
        (self.selected, self.identified) = (0, 0);
        let boots_up = is_left && node_id.is_none() && self.pending.node_id.is_some();
        if boots_up { Outcome::BootUp } else { Outcome::Silence }
    }

    fn select(&mut self, part: Part, value: u32, identity: &Identity) -> Outcome {
        let matches = !self.is_selected && value == identity.part(part);
        self.selected = advance(self.selected, part.number(), matches);
        if usize::from(self.selected) < Part::ALL.len() {
            return Outcome::Silence;
        }
        (self.selected, self.is_selected) = (0, true);
        Outcome::Answer(Response::Selected)
    }

    fn identify(&mut self, bound: Bound, value: u32, identity: &Identity) -> Outcome {
        let matches = match bound {
            Bound::Vendor => value == identity.vendor,
            Bound::Product => value == identity.product,
            Bound::RevisionLow => value <= identity.revision,
            Bound::RevisionHigh => value >= identity.revision,
            Bound::SerialLow => value <= identity.serial,
            Bound::SerialHigh => value >= identity.serial,
        };
        self.identified = advance(self.identified, bound as u8, matches);
        if usize::from(self.identified) < Bound::ALL.len() {
            return Outcome::Silence;
        }
        self.identified = 0;
        Outcome::Answer(Response::Identified)
    }

    fn is_unconfigured(&self, node_id: Option<NodeId>) -> bool {
        node_id.is_none() && self.pending.node_id.is_none()
    }

    /// Whether the slave takes part in a fastscan. A slave that has been found already does not.
    fn is_scanned(&self, node_id: Option<NodeId>) -> bool {
        !self.is_selected && self.is_unconfigured(node_id)
    }

    fn fastscan(&mut self, identity: &Identity, value: u32, bit: u8, part: u8, next: u8) -> Outcome {
        let step = self.scan.step(identity, value, bit, part, next);
        self.is_selected = step == Step::Found;
        if step == Step::Silent { Outcome::Silence } else { Outcome::Answer(Response::Identified) }
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

/// Counts the messages of a series. Each must arrive in order and match; the first message always restarts the series.
fn advance(done: u8, number: u8, matches: bool) -> u8 {
    let is_in_turn = number == 0 || number == done;
    if is_in_turn && matches { number.saturating_add(1) } else { 0 }
}
