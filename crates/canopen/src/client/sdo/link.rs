//! The state that all kinds of transfer share: the CAN-IDs, the frame to send next, and the deadline of the answer.

use super::{AbortCode, Error, Options, SEGMENT_TIME};
use crate::client::service::later;
use crate::sdo::{Abort, BlockSegment, Multiplexer, Request, Response};
use crate::{CanId, Duration, Frame, Instant, NodeId};

/// CAN-IDs of the default SDO channel without the node-ID (CiA 301, 7.3.5).
const TO_SERVER: u16 = 0x600;
const FROM_SERVER: u16 = 0x580;

/// The two CAN-IDs between a client and a server: the default ones of a node, or those of an SDO client object (1280h
/// and up, [`Device::sdo_client`](crate::Device::sdo_client)).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The CAN-ID of the requests.
    pub to_server: CanId,
    /// The CAN-ID of the responses.
    pub from_server: CanId,
}

impl From<NodeId> for Channel {
    /// The default channel of a node.
    fn from(node: NodeId) -> Channel {
        Channel { to_server: node.service(TO_SERVER), from_server: node.service(FROM_SERVER) }
    }
}

/// The connection to one server.
#[derive(Debug)]
pub struct Link {
    channel: Channel,
    /// The object of the transfer.
    pub(super) at: Multiplexer,
    pub(super) options: Options,
    /// The frame to send next.
    outgoing: Option<[u8; 8]>,
    /// The next answer is the first one of a transfer, and names the object of the transfer.
    is_first: bool,
    /// The longest time until the next answer.
    patience: Duration,
    answer_by: Instant,
    /// A frame that does not fit has arrived since the last request.
    has_unexpected: bool,
    /// The newest frame of the server. A frame that arrives twice in a row counts once.
    newest: Option<[u8; 8]>,
}

impl Link {
    pub(super) fn new(channel: Channel, at: Multiplexer, options: Options) -> Link {
        Link {
            channel,
            at,
            options,
            outgoing: None,
            is_first: false,
            patience: options.timeout,
            answer_by: Instant::NEVER,
            has_unexpected: false,
            newest: None,
        }
    }

    /// Sends the first request of a transfer.
    pub(super) fn begin(&mut self, request: Request) {
        self.newest = None;
        self.ask(request);
        self.is_first = true;
    }

    /// Sends a request. The answer is due within the usual time-out.
    pub(super) fn ask(&mut self, request: Request) {
        self.outgoing = Some(request.encode());
        self.is_first = false;
        self.has_unexpected = false;
        self.patience = self.options.timeout;
    }

    /// Ends the transfer at the server. The server does not answer an abort message.
    pub(super) fn give_up(&mut self, code: AbortCode) {
        self.outgoing = Some(Request::Abort(self.at, code.0).encode());
    }

    /// The frame to send next, if any. The time for the answer begins.
    pub(super) fn outgoing(&mut self, now: Instant) -> Option<Frame> {
        let data = self.outgoing.take()?;
        self.answer_by = later(now, self.patience);
        Some(self.frame(data))
    }

    /// A frame for a segment of a block. The answer is due within the usual time-out after the segments, which may all
    /// wait still.
    pub(super) fn segment(&mut self, segment: BlockSegment, now: Instant) -> Frame {
        self.has_unexpected = false;
        self.wait_for_block(segment.sequence.get(), now);
        self.frame(segment.encode())
    }

    /// Sets the longest time until the answer to so many segments, none of which has been on the bus yet.
    pub(super) fn wait_for_block(&mut self, segments: u8, now: Instant) {
        let sending = Duration(SEGMENT_TIME.0 * u64::from(segments));
        self.wait(Duration(sending.0.saturating_add(self.options.timeout.0)), now);
    }

    fn frame(&self, data: [u8; 8]) -> Frame {
        Frame::data_frame(self.channel.to_server, 8, data)
    }

    /// Sets the longest time until the next frame of the server.
    pub(super) fn wait(&mut self, patience: Duration, now: Instant) {
        self.answer_by = later(now, patience);
    }

    /// The deadline of the next frame of the server.
    pub(super) fn answer_by(&self) -> Instant {
        self.answer_by
    }

    /// The data of a frame from the server. A frame cannot be an answer while a request still waits to be sent.
    pub(super) fn response(&self, frame: &Frame) -> Option<[u8; 8]> {
        frame.full(self.channel.from_server).copied().filter(|_| self.outgoing.is_none())
    }

    /// Whether a frame repeats the newest frame.
    pub(super) fn is_repeated(&mut self, data: [u8; 8]) -> bool {
        self.newest.replace(data) == Some(data)
    }

    /// The next frame of the server may be equal to the newest one without being a repetition.
    pub(super) fn expect_equal(&mut self) {
        self.newest = None;
    }

    /// The code of an abort message that concerns this transfer. While the first answer is due, an abort message for
    /// another object is late and ignored. But a server that does not understand a request may leave the object 0, or
    /// name the object of the transfer before.
    ///
    /// The first byte of a block segment may look like an abort message; but no segment has the sequence number 0.
    pub(super) fn refusal(&self, data: [u8; 8]) -> Option<AbortCode> {
        let Some(Response::Abort(of, code)) = Response::parse(data).filter(|_| data[0] == 0x80) else {
            return None;
        };
        let is_not_understood = code == Abort::Command.code() || of == Multiplexer::default();
        let is_ours = !self.is_first || of == self.at || is_not_understood;
        is_ours.then_some(AbortCode(code))
    }

    pub(super) fn note_unexpected(&mut self) {
        self.has_unexpected = true;
    }

    /// The error for an answer that did not arrive.
    pub(super) fn silence(&self) -> Error {
        if self.has_unexpected { Error::Unexpected } else { Error::NoAnswer }
    }
}
