//! The LSS services: each is an exchange, or one frame.

use super::{Error, Exchange, Name, Options, frame};
use crate::lss::{BitRate, Identity, Part, Request, Response};
use crate::{Frame, NodeId};

/// Switch state global: switches all slaves to the configuration state, or back to the waiting state. A slave that has
/// received its first node-ID boots with this node-ID when it returns to the waiting state.
#[must_use]
pub fn switch_global(configuration: bool) -> Frame {
    frame(Request::SwitchGlobal { configuration })
}

/// Activate bit timing parameters: the selected slaves change to their new bit rate after `delay` ms, and send nothing
/// for another `delay` ms. The master has to change its own bit rate too.
#[must_use]
pub fn activate_bit_rate(delay: u16) -> Frame {
    frame(Request::Activate { delay })
}

/// Switch state selective: switches the slave with this identity to the configuration state. Slaves that are in this
/// state already stay there; [`switch_global`] releases them.
#[must_use]
pub fn select(identity: &Identity, options: Options) -> Exchange<()> {
    let requests = Part::ALL.map(|part| Some(Request::Select(part, identity.part(part))));
    Exchange::of(
        requests,
        Name::Select,
        |_, response| (response == Response::Selected).then_some(Ok(())),
        options,
    )
}

/// Identify non-configured remote slaves: asks whether there is a slave without a node-ID. All such slaves answer with
/// the same frame. The result is [`Error::NoAnswer`] without an answer.
#[must_use]
pub fn identify_unconfigured(options: Options) -> Exchange<()> {
    let interpret = |_, response| (response == Response::Unconfigured).then_some(Ok(()));
    Exchange::new(Name::Identify, Request::IdentifyUnconfigured, interpret, options)
}

/// Inquire identity: one part of the identity of the selected slave.
#[must_use]
pub fn inquire(part: Part, options: Options) -> Exchange<u32> {
    let interpret = |request, response| match (request, response) {
        (Request::Inquire(asked), Response::Identity(part, value)) if part == asked => Some(Ok(value)),
        _ => None,
    };
    Exchange::new(Name::Inquire, Request::Inquire(part), interpret, options)
}

/// Inquire node-ID: the node-ID of the selected slave; `None` when the slave has none.
#[must_use]
pub fn inquire_node_id(options: Options) -> Exchange<Option<NodeId>> {
    let interpret = |_, response| match response {
        Response::NodeIdIs(id) => Some(Ok(NodeId::new(id))),
        _ => None,
    };
    Exchange::new(Name::Inquire, Request::InquireNodeId, interpret, options)
}

/// Configure node-ID: gives the selected slave a node-ID, or takes the node-ID away with `None`. The slave uses the new
/// node-ID after the next reset of the communication; a slave that had no node-ID uses it at once.
#[must_use]
pub fn set_node_id(node_id: Option<NodeId>, options: Options) -> Exchange<()> {
    let interpret = |_, response| match response {
        Response::NodeId(code) => Some(result(Name::NodeId, code)),
        _ => None,
    };
    Exchange::new(Name::NodeId, Request::NodeId(node_id.map_or(u8::MAX, NodeId::get)), interpret, options)
}

/// Configure bit timing parameters: gives the selected slave a bit rate for [`activate_bit_rate`] or its next start.
#[must_use]
pub fn set_bit_rate(bit_rate: BitRate, options: Options) -> Exchange<()> {
    let interpret = |_, response| match response {
        Response::BitTiming(code) => Some(result(Name::BitRate, code)),
        _ => None,
    };
    let request = Request::BitTiming { table: 0, index: bit_rate.index() };
    Exchange::new(Name::BitRate, request, interpret, options)
}

/// Store configuration: the selected slave stores node-ID and bit rate in non-volatile memory. The slave may need more
/// time than for other requests.
#[must_use]
pub fn store(options: Options) -> Exchange<()> {
    let interpret = |_, response| match response {
        Response::Stored(code) => Some(result(Name::Store, code)),
        _ => None,
    };
    Exchange::new(Name::Store, Request::Store, interpret, options)
}

fn result(name: Name, code: u8) -> Result<(), Error> {
    if code == 0 { Ok(()) } else { Err(Error::Refused(name, code)) }
}
