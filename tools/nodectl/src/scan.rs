//! Search for the nodes on the bus.

use std::collections::BTreeMap;

use canopen::nmt::State;
use canopen::sdo::{Request, Response};
use canopen::{Duration, Frame, NodeId};

use crate::Network;
use crate::bus::BusError;
use crate::heartbeat::Heartbeat;
use crate::object::at;
use crate::sdo::{Cause, Client, Error, Options};

/// The time between two requests, so that no queue overflows.
const PACE: Duration = Duration::from_millis(2);

/// The signs of a node that were heard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Presence {
    /// The device type (1000h), where the node has answered.
    pub device_type: Option<u32>,
    /// The state, where a heartbeat was heard.
    pub state: Option<State>,
}

/// Asks all node-IDs for their device type and listens this long after the last question.
///
/// # Errors
/// The bus is lost.
pub fn scan(network: &mut Network, time: Duration) -> Result<BTreeMap<NodeId, Presence>, BusError> {
    let (mut found, begin) = (BTreeMap::new(), network.now());
    for node in (1..=127).filter_map(NodeId::new) {
        network.pass()?;
        ask(network, node)?;
        listen(network, PACE, &mut found)?;
    }
    listen(network, time, &mut found)?;
    for (node, presence) in &mut found {
        if presence.device_type.is_none() && network.has_other_request_since(*node, begin) {
            ask_again(network, *node, presence)?;
        }
    }
    Ok(found)
}

/// Asks a node whose SDO server another client has used during the scan: the server serves one transfer at a time.
fn ask_again(network: &mut Network, node: NodeId, presence: &mut Presence) -> Result<(), BusError> {
    match Client::new(network, node, Options::default()).upload(at(0x1000, 0)) {
        Ok(bytes) => presence.device_type = bytes.try_into().ok().map(u32::from_le_bytes),
        Err(Error { cause: Cause::Bus(error), .. }) => return Err(error),
        Err(_) => {}
    }
    Ok(())
}

/// Asks a node for its device type.
pub(crate) fn ask(network: &mut Network, node: NodeId) -> Result<(), BusError> {
    let question = Request::Upload(at(0x1000, 0)).encode();
    Frame::new(0x600 + u16::from(node.get()), &question).map_or(Ok(()), |frame| network.send(&frame))
}

fn listen(
    network: &mut Network,
    time: Duration,
    found: &mut BTreeMap<NodeId, Presence>,
) -> Result<(), BusError> {
    let until = network.now() + time;
    network.wait(until, |frame| {
        if let Some(heartbeat) = Heartbeat::parse(frame) {
            found.entry(heartbeat.node).or_default().state = Some(heartbeat.state);
        }
        if let Some((node, device_type)) = answer(frame) {
            // An answer to another client is the sign of a node, and has no device type.
            let presence = found.entry(node).or_default();
            presence.device_type = device_type.or(presence.device_type);
        }
        None::<()>
    })?;
    Ok(())
}

/// The node of an answer, and its device type. An abort is an answer, too.
fn answer(frame: &Frame) -> Option<(NodeId, Option<u32>)> {
    let node = u8::try_from(frame.id().checked_sub(0x580)?).ok().and_then(NodeId::new)?;
    let device_type = match Response::parse(frame.data().try_into().ok()?)? {
        Response::Uploaded(of, bytes) if of == at(0x1000, 0) => Some(u32::from_le_bytes(bytes.padded())),
        _ => None,
    };
    Some((node, device_type))
}
