//! Other clients on the bus.
//!
//! An SDO channel has one client (CiA 301, 7.2.4): a client that sends a request while a transfer of another client
//! runs disturbs both. This program cannot know whether it is the only client of a node. So it listens to the transfers
//! of other clients, and sends its request when none runs. It also listens to other LSS masters: nodes that change their
//! bit rate are silent.

use std::collections::{BTreeMap, BTreeSet};

use canopen::lss::Request;
use canopen::{Duration, Frame, Instant, NodeId};

use crate::sdo::Channel;
use crate::trace::{Transferred, Transfers};

/// A transfer without a frame for this time was given up by its client.
const GIVEN_UP: Duration = Duration::from_millis(2000);

/// The SDO transfers of other clients. Frames of this program must not be handed over.
#[derive(Debug, Default)]
pub(crate) struct OtherClients {
    default: Servers,
    /// The additional servers that this program uses.
    additional: Servers,
    channels: BTreeMap<NodeId, Channel>,
    retuning: Retuning,
}

/// A frame that comes later after the command to change the bit rate was not in a mailbox of the node before.
const MAILBOX: Duration = Duration::from_millis(100);

/// The bit rate of nodes changes, by the command of another LSS master.
#[derive(Debug, Default)]
struct Retuning {
    since: Instant,
    /// When the nodes may send again.
    until: Instant,
    /// The nodes that the command was not for: they were heard.
    heard: BTreeSet<NodeId>,
}

/// The servers of one kind, one for each node.
#[derive(Debug, Default)]
struct Servers {
    transfers: Transfers,
    /// The newest request and the newest frame of each server.
    heard: BTreeMap<NodeId, Heard>,
}

/// The times of the newest frames between a server and another client.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Heard {
    pub(crate) request: Instant,
    frame: Instant,
    /// A client that sends the segments of a block without a pause has no answer from the server.
    pub(crate) answer: Instant,
    block: Block,
}

/// A block transfer whose begin was not heard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Block {
    None,
    /// The server has acknowledged a block.
    Download,
    /// The client has acknowledged a block.
    Upload,
}

/// The acknowledge of a block, by the server or by the client (CiA 301, 7.2.4.3).
const ACKNOWLEDGE: u8 = 0xA2;

impl OtherClients {
    /// Takes a frame from the bus. Returns the transfer that the frame has ended.
    pub(crate) fn on_frame(&mut self, frame: &Frame, now: Instant) -> Option<(NodeId, Transferred)> {
        if let Some((node, true, frame)) = self.sdo(frame) {
            return self.additional.on_frame(node, &frame, now);
        }
        if let Some(delay) = switch_delay(frame) {
            self.retuning = Retuning { since: now, until: now + delay + delay, heard: BTreeSet::new() };
        }
        let node = NodeId::new(u8::try_from(frame.id() & 0x7F).ok()?)?;
        let is_of_node = matches!(frame.id(), 0x581..=0x5FF | 0x701..=0x77F);
        if is_of_node && now > self.retuning.since + MAILBOX {
            self.retuning.heard.insert(node);
        }
        let is_sdo = matches!(frame.id(), 0x581..=0x5FF | 0x601..=0x67F);
        is_sdo.then(|| self.default.on_frame(node, frame, now))?
    }

    /// The node of an SDO frame, whether its channel is an additional one, and the frame with its CAN-ID on the default
    /// channel; `None` for any other frame.
    pub(crate) fn sdo(&self, frame: &Frame) -> Option<(NodeId, bool, Frame)> {
        if let Some((node, channel)) = self.channels.iter().find(|(_, channel)| channel.has(frame)) {
            return Some((*node, true, channel.to_default(*node, frame)?));
        }
        let node = NodeId::new(u8::try_from(frame.id() & 0x7F).ok()?)?;
        matches!(frame.id(), 0x581..=0x5FF | 0x601..=0x67F).then_some((node, false, *frame))
    }

    /// The channel that this program uses for a node: the default one where no other is set.
    pub(crate) fn channel(&self, node: NodeId) -> Channel {
        self.channels.get(&node).copied().unwrap_or(Channel::default_of(node))
    }

    /// Sets the channel of a node; `None` for the default one.
    pub(crate) fn set_channel(&mut self, node: NodeId, channel: Option<Channel>) {
        match channel {
            Some(channel) => self.channels.insert(node, channel),
            None => self.channels.remove(&node),
        };
    }

    /// Whether another client's transfer runs on the channel that this program uses for a node, or the node changes its
    /// bit rate.
    pub(crate) fn is_busy(&self, node: NodeId, now: Instant) -> bool {
        self.servers(node).is_busy(node, now)
            || (now < self.retuning.until && !self.retuning.heard.contains(&node))
    }

    /// Whether a transfer of another client runs on the channel with this CAN-ID of the requests.
    pub(crate) fn has_transfer(&self, request: u16, now: Instant) -> bool {
        let additional = self.channels.iter().find(|(_, channel)| channel.request == request);
        let default = || match request {
            0x601..=0x67F => u8::try_from(request & 0x7F).ok().and_then(NodeId::new),
            _ => None,
        };
        match additional {
            Some((node, _)) => self.additional.is_busy(*node, now),
            None => default().is_some_and(|node| self.default.is_busy(node, now)),
        }
    }

    /// The time since the newest frame of another client's transfer on that channel; `None` where there was none.
    pub(crate) fn quiet(&self, node: NodeId, now: Instant) -> Option<Duration> {
        Some(Duration(now.0.saturating_sub(self.heard(node)?.frame.0)))
    }

    /// The newest frames of the transfers of other clients on that channel; `None` where there was none.
    pub(crate) fn heard(&self, node: NodeId) -> Option<Heard> {
        self.servers(node).heard.get(&node).copied()
    }

    /// The time since the newest request of another client to a node; `None` where there was none.
    pub(crate) fn since_request(&self, node: NodeId, now: Instant) -> Option<Duration> {
        let heard = self.default.heard.get(&node)?;
        Some(Duration(now.0.saturating_sub(heard.request.0)))
    }

    fn servers(&self, node: NodeId) -> &Servers {
        if self.channels.contains_key(&node) { &self.additional } else { &self.default }
    }
}

impl Servers {
    fn on_frame(&mut self, node: NodeId, frame: &Frame, now: Instant) -> Option<(NodeId, Transferred)> {
        let is_request = frame.id() >= 0x600;
        let is_acknowledge = frame.data().first() == Some(&ACKNOWLEDGE);
        if is_request {
            let before = self.heard.get(&node).map_or(Block::None, |heard| heard.block);
            let block = match before {
                _ if is_acknowledge => Block::Upload,
                Block::Upload => Block::None,
                before => before,
            };
            let answer = self.heard.get(&node).map_or(Instant(0), |heard| heard.answer);
            self.heard.insert(node, Heard { request: now, frame: now, answer, block });
        } else if let Some(heard) = self.heard.get_mut(&node) {
            heard.answer = now;
            heard.block = match heard.block {
                _ if is_acknowledge => Block::Download,
                Block::Download => Block::None,
                before => before,
            };
            if self.transfers.has(node) {
                heard.frame = now;
            }
        }
        let ended = self.transfers.on_frame(node, frame, now);
        ended.into_iter().next_back().map(|ended| (node, ended))
    }

    fn is_busy(&self, node: NodeId, now: Instant) -> bool {
        let is_recent = |at: Instant| now.0.saturating_sub(at.0) < GIVEN_UP.0;
        let Some(heard) = self.heard.get(&node) else { return false };
        // The answers to this program are heard too, so only the requests of another client keep its block alive.
        let is_in_block = heard.block != Block::None && is_recent(heard.request);
        is_in_block || self.transfers.has(node) && is_recent(heard.frame)
    }
}

/// The delay of the LSS request *activate bit timing*: nodes are silent for twice that time (CiA 305).
fn switch_delay(frame: &Frame) -> Option<Duration> {
    let data = frame.data().try_into().ok().filter(|_| frame.id() == 0x7E5)?;
    match Request::parse(data)? {
        Request::Activate { delay } => Some(Duration::from_millis(delay.into())),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node() -> NodeId {
        NodeId::new(5).unwrap()
    }

    fn frame(id: u16, data: [u8; 8]) -> Frame {
        Frame::new(id, &data).unwrap()
    }

    const READ: [u8; 8] = [0x40, 0x00, 0x10, 0, 0, 0, 0, 0];
    const ANSWER: [u8; 8] = [0x43, 0x00, 0x10, 0, 0x91, 1, 0, 0];

    #[test]
    fn a_node_is_busy_from_the_request_of_another_client_to_its_answer() {
        let mut others = OtherClients::default();
        assert!(!others.is_busy(node(), Instant(0)));
        assert!(others.on_frame(&frame(0x605, READ), Instant(10)).is_none());
        assert!(others.is_busy(node(), Instant(20)));
        assert!(!others.is_busy(NodeId::new(6).unwrap(), Instant(20)));
        let (of, ended) = others.on_frame(&frame(0x585, ANSWER), Instant(30)).unwrap();
        assert_eq!((of, ended.read()), (node(), Some(&[0x91, 1, 0, 0][..])));
        assert!(!others.is_busy(node(), Instant(40)));
        assert_eq!(others.quiet(node(), Instant(40)), Some(Duration(10)));
        assert_eq!(others.since_request(node(), Instant(40)), Some(Duration(30)));
    }

    #[test]
    fn a_transfer_without_an_answer_is_given_up() {
        let mut others = OtherClients::default();
        others.on_frame(&frame(0x605, READ), Instant(0));
        assert!(others.is_busy(node(), Instant(GIVEN_UP.0 - 1)));
        assert!(!others.is_busy(node(), Instant(GIVEN_UP.0)));
    }

    /// The answer to a request of this program does not end the transfer of another client for another object.
    #[test]
    fn an_answer_for_another_object_ends_nothing() {
        let mut others = OtherClients::default();
        others.on_frame(&frame(0x605, READ), Instant(0));
        assert!(others.on_frame(&frame(0x585, [0x43, 0x17, 0x10, 0, 1, 0, 0, 0]), Instant(1)).is_none());
        assert!(others.is_busy(node(), Instant(2)));
    }

    /// A client that comes in the middle of a transfer has not heard its begin.
    #[test]
    fn a_block_transfer_whose_begin_was_not_heard_is_busy_until_its_end() {
        let segment = [5, 1, 2, 3, 4, 5, 6, 7];
        let acknowledge = [0xA2, 127, 127, 0, 0, 0, 0, 0];
        let answer = |others: &OtherClients| others.heard(node()).expect("a client").answer;
        let mut others = OtherClients::default();
        others.on_frame(&frame(0x605, segment), Instant(0));
        others.on_frame(&frame(0x585, acknowledge), Instant(10));
        assert!(others.is_busy(node(), Instant(20)) && answer(&others) == Instant(10));
        others.on_frame(&frame(0x605, segment), Instant(30));
        assert!(others.is_busy(node(), Instant(40)) && answer(&others) == Instant(10));
        others.on_frame(&frame(0x585, [0xA1, 0, 0, 0, 0, 0, 0, 0]), Instant(50));
        assert!(!others.is_busy(node(), Instant(60)));
        others.on_frame(&frame(0x605, acknowledge), Instant(70));
        assert!(others.is_busy(node(), Instant(80)));
        others.on_frame(&frame(0x605, [0xA1, 0, 0, 0, 0, 0, 0, 0]), Instant(90));
        assert!(!others.is_busy(node(), Instant(100)));
        others.on_frame(&frame(0x605, acknowledge), Instant(110));
        assert!(!others.is_busy(node(), Instant(110 + GIVEN_UP.0)));
    }

    #[test]
    fn nodes_that_change_their_bit_rate_are_busy_until_then() {
        let mut others = OtherClients::default();
        others.on_frame(&frame(0x7E5, [0x15, 100, 0, 0, 0, 0, 0, 0]), Instant(1000));
        assert!(others.is_busy(node(), Instant(200_999)));
        assert!(!others.is_busy(node(), Instant(201_000)));
        let heartbeat = Frame::new(0x705, &[5]).unwrap();
        others.on_frame(&heartbeat, Instant(2000));
        assert!(others.is_busy(node(), Instant(150_000)), "the frame was in a mailbox");
        others.on_frame(&heartbeat, Instant(150_000));
        assert!(!others.is_busy(node(), Instant(150_001)), "the command is not for a node that is heard");
    }

    #[test]
    fn on_the_second_channel_transfers_on_the_default_one_do_not_matter() {
        let mut others = OtherClients::default();
        others.set_channel(node(), Channel::of_cob_ids(0x645, 0x5C5));
        others.on_frame(&frame(0x605, READ), Instant(0));
        assert!(!others.is_busy(node(), Instant(1)));
        others.on_frame(&frame(0x645, READ), Instant(2));
        assert!(others.is_busy(node(), Instant(3)));
        others.on_frame(&frame(0x5C5, ANSWER), Instant(4));
        assert!(!others.is_busy(node(), Instant(5)));
    }
}
