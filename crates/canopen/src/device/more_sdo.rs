//! SDO beside the default server: further servers (1201h and up) and clients (1280h and up). Their CAN-IDs are those of
//! the image at each moment.

use super::inner::Inner;
use super::{Definition, Device};
use crate::client::sdo;
use crate::dictionary::{Entry, Services};
use crate::sdo::Abort;
use crate::transmit::Context;
use crate::{CanId, CobId, Frame, NodeId, Tick, Transmit};

/// The first further server, and the first client.
const SERVERS: u16 = 0x1201;
const CLIENTS: u16 = 0x1280;
const MOST_CLIENTS: u16 = 128;

impl<D: Definition> Device<D> {
    /// Takes a frame, if it is a request to a further server.
    #[inline(never)]
    pub(super) fn take_more_sdo(&mut self, frame: &Frame, now: Tick, out: &mut impl Transmit) {
        let is_of = |(request, _): &(CanId, CanId)| request.get() == frame.id();
        let mut numbers = 0..self.services.more_sdo.as_ref().len();
        let Some((number, (id, response))) =
            numbers.find_map(|number| Some((number, self.inner.server_ids(number).filter(is_of)?)))
        else {
            return;
        };
        let request = Inner::<D>::request(frame, id.into()).filter(|_| self.inner.state.has_services());
        let context = &mut self.services.context(now, out);
        if let (Some(request), Some(channel)) = (request, self.services.more_sdo.as_mut().get_mut(number))
            && !channel.take_segment(request, now)
        {
            let due = channel.take(request, response, &mut self.inner, context);
            self.inner.serve_until(due);
        }
    }

    /// Sends what is due on the further channels. A channel that has been disabled forgets its transfer.
    #[inline(never)]
    pub(super) fn poll_more_sdo(&mut self, context: &mut Context<'_, impl Transmit>) {
        for (number, channel) in self.services.more_sdo.as_mut().iter_mut().enumerate() {
            match self.inner.server_ids(number) {
                Some((_, response)) => channel.poll(response, &mut self.inner, context),
                None => channel.forget(&mut self.inner),
            }
        }
    }

    /// A job is finished: answers the clients that wait for it.
    #[inline(never)]
    pub(super) fn release_more(
        &mut self,
        result: Result<(), Abort>,
        context: &mut Context<'_, impl Transmit>,
    ) {
        for (number, channel) in self.services.more_sdo.as_mut().iter_mut().enumerate() {
            if let Some((_, response)) = self.inner.server_ids(number) {
                channel.release(result, response, &mut self.inner, context);
            }
        }
    }

    /// The channel of an SDO client (1280h and up), by its number from 1, for a transfer of
    /// [`client::sdo`](crate::client::sdo). `None` while the object disables the client, and in an NMT state without SDO.
    #[must_use]
    pub fn sdo_client(&self, number: u8) -> Option<sdo::Channel> {
        let inner = &self.inner;
        let is_on = Inner::<D>::has(Services::SDO_CLIENT) && inner.state.has_services();
        let index = CLIENTS + u16::from(number.checked_sub(1)?).min(MOST_CLIENTS);
        let (to_server, from_server) = inner.channel_ids(index).filter(|_| is_on)?;
        Some(sdo::Channel { to_server, from_server })
    }
}

impl<D: Definition> Inner<D> {
    /// The CAN-IDs in the sub-indexes 1 and 2 of an SDO object; `None` unless both are enabled.
    fn channel_ids(&self, index: u16) -> Option<(CanId, CanId)> {
        let id = |sub| CobId::enabled(self.number_or(index, sub, u32::MAX));
        id(1).zip(id(2))
    }

    /// The CAN-IDs of the requests and of the responses of a further server, by its number from 0.
    #[allow(clippy::cast_possible_truncation)] // At most 127 servers.
    fn server_ids(&self, number: usize) -> Option<(CanId, CanId)> {
        self.channel_ids(SERVERS + (number as u16 & 0x7F))
    }

    /// The CAN-IDs of further servers, of clients and of consumed EMCYs. The compiler removes all of them where the rows
    /// have none of them.
    pub(super) fn more_service_ids(&self) -> impl Iterator<Item = CanId> {
        let mut ids = self.emcy_ids().chain(self.server_requests()).chain(self.client_responses());
        let has_any = Self::has(Services::EMCY_CONSUMER)
            || Self::has(Services::SDO_SERVERS)
            || Self::has(Services::SDO_CLIENT);
        core::iter::from_fn(move || if has_any { ids.next() } else { None })
    }

    /// The CAN-IDs of requests to the further servers.
    fn server_requests(&self) -> impl Iterator<Item = CanId> {
        let servers = self.dictionary.indexes(SERVERS, CLIENTS);
        let servers = servers.filter(|_| Self::has(Services::SDO_SERVERS));
        servers.filter_map(|index| self.channel_ids(index).map(|(request, _)| request))
    }

    /// The CAN-IDs of responses to the clients.
    fn client_responses(&self) -> impl Iterator<Item = CanId> {
        let clients = self.dictionary.indexes(CLIENTS, CLIENTS + MOST_CLIENTS);
        let clients = clients.filter(|_| Self::has(Services::SDO_CLIENT));
        clients.filter_map(|index| self.channel_ids(index).map(|(_, response)| response))
    }

    /// Checks a COB-ID of a client. The default channel of another node is allowed, although its CAN-IDs are restricted.
    pub(super) fn check_client(&self, entry: &Entry, value: u32) -> Result<(), Abort> {
        let Some(id) = CobId::check_place(self.word(entry.field), value)? else { return Ok(()) };
        let default = if entry.sub() == 1 { 0x600 } else { 0x580 };
        let node = id.get().checked_sub(default).and_then(|node| u8::try_from(node).ok());
        let is_default = node.and_then(NodeId::new).is_some_and(|node| Some(node) != self.node_id);
        if is_default || !id.is_restricted() { Ok(()) } else { Err(Abort::InvalidValue) }
    }
}
