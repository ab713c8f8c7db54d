//! The CAN-IDs of an SDO server.

use canopen::client::{Service, Step, Taken};
use canopen::{CobId, Frame, Instant, NodeId};

/// The CAN-IDs of an SDO server (CiA 301, 7.5.2.33): of the requests, and of the responses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    pub(crate) request: u16,
    pub(crate) response: u16,
}

impl Channel {
    /// The default SDO server of a node.
    #[must_use]
    pub fn default_of(node: NodeId) -> Channel {
        let node = u16::from(node.get());
        Channel { request: 0x600 + node, response: 0x580 + node }
    }

    /// The additional SDO server with these COB-IDs (1201h:1 and 2); `None` where one of them is switched off.
    #[must_use]
    pub fn of_cob_ids(request: u32, response: u32) -> Option<Channel> {
        let id = |cob_id| Some(CobId::parse(cob_id).filter(|cob_id| !cob_id.bit31)?.id.get());
        let (request, response) = (id(request)?, id(response)?);
        (request != 0 && response != 0 && request != response).then_some(Channel { request, response })
    }

    /// Whether a frame belongs to this channel.
    pub(crate) fn has(self, frame: &Frame) -> bool {
        [self.request, self.response].contains(&frame.id())
    }

    /// A frame of this channel with the CAN-ID that it has on the default channel; `None` for any other frame.
    pub(crate) fn to_default(self, node: NodeId, frame: &Frame) -> Option<Frame> {
        let default = Channel::default_of(node);
        match frame.id() {
            id if id == self.request => Frame::new(default.request, frame.data()),
            id if id == self.response => Frame::new(default.response, frame.data()),
            _ => None,
        }
    }
}

/// A service of the default channel, on another channel.
pub(super) struct Via<'s, S> {
    pub(super) service: &'s mut S,
    pub(super) node: NodeId,
    pub(super) channel: Channel,
}

impl<S: Service> Service for Via<'_, S> {
    type Output = S::Output;

    fn next(&mut self, now: Instant) -> Step<S::Output> {
        match self.service.next(now) {
            Step::Send(frame) => Step::Send(Frame::new(self.channel.request, frame.data()).unwrap_or(frame)),
            step => step,
        }
    }

    fn on_frame(&mut self, frame: &Frame, now: Instant) -> Taken {
        match self.channel.to_default(self.node, frame) {
            Some(frame) => self.service.on_frame(&frame, now),
            None => Taken::Ignored,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_channel_needs_two_cob_ids_that_are_switched_on() {
        assert_eq!(Channel::of_cob_ids(0x641, 0x5C1), Some(Channel { request: 0x641, response: 0x5C1 }));
        for (request, response) in
            [(0x8000_0641, 0x5C1), (0x641, 0x8000_05C1), (1 << 31, 1 << 31), (0, 0), (0x641, 0x641)]
        {
            assert_eq!(Channel::of_cob_ids(request, response), None, "{request:X} {response:X}");
        }
    }
}
