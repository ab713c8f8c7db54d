//! The protocol and the transmit queue, shared by process data and services.

use bsp::can::transmit_queue::TransmitQueue;
use node::Protocol;
use rtic::mutex_prelude::*;

use crate::TRANSMIT;

/// The only access to the protocol: for one call, followed by a check of the transmit queue.
pub(crate) trait Shared {
    /// Calls into the protocol, then wakes the transmit task when frames wait.
    fn call<R>(&mut self, f: impl FnOnce(&mut Protocol, &mut TransmitQueue) -> R) -> R;
}

impl<P: Mutex<T = &'static mut Protocol>, Q: Mutex<T = TransmitQueue>> Shared for (P, Q) {
    fn call<R>(&mut self, f: impl FnOnce(&mut Protocol, &mut TransmitQueue) -> R) -> R {
        let (protocol, queue) = self;
        (protocol, queue).lock(|protocol, queue| {
            let result = f(protocol, queue);
            if !queue.is_empty() {
                rtic::pend(TRANSMIT);
            }
            result
        })
    }
}
