//! An LSS master for tests (CiA 305): finds devices without a node-ID and gives them one.

use canopen::lss::{Identity, Part, Request, Response};
use canopen::{Duration, Frame, NodeId};

use crate::network::{Network, Unit};

const REQUEST: u16 = 0x7E5;
const RESPONSE: u16 = 0x7E4;
/// How long nobody answers before nobody is taken to be there: a frame at 1 Mbit/s and as much again.
const TIME_OUT: Duration = Duration(300);

/// The master of one network.
#[derive(Debug)]
pub struct Master<'a, U> {
    network: &'a mut Network<U>,
}

impl<'a, U: Unit> Master<'a, U> {
    /// The master of this network.
    pub fn new(network: &'a mut Network<U>) -> Master<'a, U> {
        Master { network }
    }

    fn tell(&mut self, request: Request) {
        while self.network.hear_id(RESPONSE).is_some() {}
        self.network.transmit(&Frame::new(REQUEST, &request.encode()).expect("a frame"));
    }

    /// Asks and waits for the first answer, or for all of the time-out.
    fn ask(&mut self, request: Request) -> Option<Response> {
        self.tell(request);
        let frame = self.network.await_id(RESPONSE, TIME_OUT)?;
        Response::parse(frame.data().try_into().ok()?)
    }

    fn matches(&mut self, value: u32, bit: u8, part: u8, next: u8) -> bool {
        self.ask(Request::Fastscan { value, bit, part, next }) == Some(Response::Identified)
    }

    /// Finds one device and leaves it in the state configuration.
    pub fn fastscan(&mut self) -> Option<Identity> {
        if !self.matches(0, Request::CONFIRM, 0, 0) {
            return None;
        }
        let mut found = [0; Part::ALL.len()];
        for (part, value) in (0..).zip(&mut found) {
            for bit in (0..32).rev() {
                if !self.matches(*value, bit, part, part) {
                    *value |= 1 << bit;
                }
            }
            let next = (part + 1) % 4;
            if !self.matches(*value, 0, part, next) {
                return None;
            }
        }
        let [vendor, product, revision, serial] = found;
        Some(Identity { vendor, product, revision, serial })
    }

    /// Gives the device in the state configuration a node-ID, stores it and lets it boot. `false` when it refuses.
    pub fn configure(&mut self, node_id: NodeId) -> bool {
        let is_set = self.ask(Request::NodeId(node_id.get())) == Some(Response::NodeId(0));
        let is_stored = self.ask(Request::Store) == Some(Response::Stored(0));
        self.tell(Request::SwitchGlobal { configuration: false });
        is_set && is_stored
    }
}
