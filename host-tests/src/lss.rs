//! The LSS master of crate `canopen` on a simulated bus: finds devices without a node-ID and gives them one.

use canopen::client::lss::{self, Fastscan, Options};
use canopen::client::{Service, Step};
use canopen::lss::Identity;
use canopen::{Duration, Instant, NodeId};

use crate::network::{Network, Unit};

const RESPONSE: u16 = 0x7E4;
/// The time after which a missing answer means that no device is there: the frames of request and answer at 1 Mbit/s,
/// doubled. One attempt is enough.
const OPTIONS: Options = Options { timeout: Duration(600), retries: 0 };

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

    fn now(&self) -> Instant {
        Instant(self.network.now().as_micros())
    }

    fn run<S: Service>(&mut self, mut service: S) -> S::Output {
        while self.network.hear_id(RESPONSE).is_some() {}
        loop {
            match service.next(self.now()) {
                Step::Send(frame) => self.network.transmit(&frame),
                Step::Wait(until) => {
                    let left = Duration(until.0.saturating_sub(self.now().0));
                    if let Some(frame) = self.network.await_id(RESPONSE, left) {
                        service.on_frame(&frame, self.now());
                    }
                }
                Step::Done(output) => return output,
            }
        }
    }

    /// Finds one device and leaves the device in the LSS state configuration.
    pub fn fastscan(&mut self) -> Option<Identity> {
        self.run(Fastscan::new(OPTIONS)).ok().flatten()
    }

    /// Gives the device in the state configuration a node-ID, stores the node-ID and lets the device boot. `false` when
    /// the device refuses.
    pub fn configure(&mut self, node_id: NodeId) -> bool {
        let is_set = self.run(lss::set_node_id(Some(node_id), OPTIONS)).is_ok();
        let is_stored = self.run(lss::store(OPTIONS)).is_ok();
        self.network.transmit(&lss::switch_global(false));
        is_set && is_stored
    }
}
