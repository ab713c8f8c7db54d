//! The services of the master.

use canopen::lss::{BitRate, Identity, Part, Request, Response};
use canopen::{Duration, Frame, NodeId};

use super::{Error, fastscan};
use crate::Network;

/// CAN-IDs (CiA 305, 5.1).
const REQUEST: u16 = 0x7E5;
const RESPONSE: u16 = 0x7E4;

/// The slaves that the services are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All on the bus. What they answer is of use only where there is one.
    All,
    /// The one with this identity.
    One(Identity),
}

/// The LSS master.
pub struct Master<'n> {
    network: &'n mut Network,
    timeout: Duration,
}

impl<'n> Master<'n> {
    /// A master that waits this long for answers.
    pub fn new(network: &'n mut Network, timeout: Duration) -> Master<'n> {
        Master { network, timeout }
    }

    /// Brings slaves into the state configuration.
    ///
    /// # Errors
    /// No slave has this identity, or the bus is lost. All slaves together do not answer.
    pub fn select(&mut self, selection: Selection) -> Result<(), Error> {
        self.release()?;
        match selection {
            Selection::All => self.send(Request::SwitchGlobal { configuration: true }),
            Selection::One(identity) => self.select_one(&identity),
        }
    }

    fn select_one(&mut self, identity: &Identity) -> Result<(), Error> {
        let [vendor, product, revision, serial] =
            Part::ALL.map(|part| Request::Select(part, identity.part(part)));
        for request in [vendor, product, revision] {
            self.send(request)?;
        }
        self.ask("select", serial, |response| (response == Response::Selected).then_some(()))
    }

    /// Brings all slaves back into the state waiting. Those that have got a node-ID boot with it.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn release(&mut self) -> Result<(), Error> {
        self.send(Request::SwitchGlobal { configuration: false })
    }

    /// The identity of the selected slave.
    ///
    /// # Errors
    /// No answer, or the bus is lost.
    pub fn identity(&mut self) -> Result<Identity, Error> {
        let mut words = [0; 4];
        for (word, asked) in words.iter_mut().zip(Part::ALL) {
            *word = self.ask("inquire", Request::Inquire(asked), |response| match response {
                Response::Identity(part, value) if part == asked => Some(value),
                _ => None,
            })?;
        }
        let [vendor, product, revision, serial] = words;
        Ok(Identity { vendor, product, revision, serial })
    }

    /// The node-ID of the selected slave; `None` when it has none.
    ///
    /// # Errors
    /// No answer, or the bus is lost.
    pub fn node_id(&mut self) -> Result<Option<NodeId>, Error> {
        self.ask("inquire", Request::InquireNodeId, |response| match response {
            Response::NodeIdIs(id) => Some(NodeId::new(id)),
            _ => None,
        })
    }

    /// Gives the selected slave a node-ID, or takes it away.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn set_node_id(&mut self, node_id: Option<NodeId>) -> Result<(), Error> {
        let request = Request::NodeId(node_id.map_or(u8::MAX, NodeId::get));
        self.command("node-ID", request, |response| match response {
            Response::NodeId(code) => Some(code),
            _ => None,
        })
    }

    /// Gives the selected slave a bit rate, for [`activate`](Master::activate) or its next start.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn set_bit_rate(&mut self, bit_rate: BitRate) -> Result<(), Error> {
        let request = Request::BitTiming { table: 0, index: bit_rate.index() };
        self.command("bit rate", request, |response| match response {
            Response::BitTiming(code) => Some(code),
            _ => None,
        })
    }

    /// Makes the selected slave keep its configuration.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn store(&mut self) -> Result<(), Error> {
        self.command("store", Request::Store, |response| match response {
            Response::Stored(code) => Some(code),
            _ => None,
        })
    }

    /// Makes the selected slaves change to their new bit rate, `delay` ms from now; they are silent for twice that time.
    /// The bus of this host has to change too.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn activate(&mut self, delay: u16) -> Result<(), Error> {
        self.send(Request::Activate { delay })
    }

    /// Finds a slave without a node-ID, and selects it; `None` when there is none. It takes 133 times the time-out.
    ///
    /// # Errors
    /// The bus is lost, or a slave that answered before does no more.
    pub fn fastscan(&mut self) -> Result<Option<Identity>, Error> {
        fastscan::scan(|request| self.is_answered(request))
    }

    /// Whether some slave matches. It takes the whole time, answered or not: all that match answer, one after the other,
    /// and a late answer would count for the next step.
    fn is_answered(&mut self, request: Request) -> Result<bool, Error> {
        self.send(request)?;
        let until = self.network.now() + self.timeout;
        let mut is_answered = false;
        self.network.wait(until, |frame| {
            is_answered |= response(frame) == Some(Response::Identified);
            None::<()>
        })?;
        Ok(is_answered)
    }

    fn command(
        &mut self,
        service: &'static str,
        request: Request,
        code: impl FnMut(Response) -> Option<u8>,
    ) -> Result<(), Error> {
        match self.ask(service, request, code)? {
            0 => Ok(()),
            code => Err(Error::Refused { service, code }),
        }
    }

    fn ask<T>(
        &mut self,
        service: &'static str,
        request: Request,
        mut fits: impl FnMut(Response) -> Option<T>,
    ) -> Result<T, Error> {
        self.send(request)?;
        let until = self.network.now() + self.timeout;
        let answer = self.network.wait(until, |frame| response(frame).and_then(&mut fits))?;
        answer.ok_or(Error::NoAnswer { service })
    }

    fn send(&mut self, request: Request) -> Result<(), Error> {
        let Some(frame) = Frame::new(REQUEST, &request.encode()) else { return Ok(()) };
        Ok(self.network.send(&frame)?)
    }
}

fn response(frame: &Frame) -> Option<Response> {
    let data = frame.data().try_into().ok().filter(|_| frame.id() == RESPONSE)?;
    Response::parse(data)
}
