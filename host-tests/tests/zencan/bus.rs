//! The virtual bus as the CAN interface of zencan.
//!
//! The clock of the runtime is paused and follows the bus: a wait for a frame advances the bus to its next event, and
//! the clock with it. So the time-outs of the master are in virtual time.

use std::fmt;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use canopen::Frame;
use host_tests::network::{Network, Unit, from_bus};
use zencan_client::common::CanId;
use zencan_client::common::messages::CanMessage;
use zencan_client::common::traits::{AsyncCanReceiver, AsyncCanSender, CanSendError};

/// Longest span that the bus runs without serving the clients.
const STEP: canopen::Duration = canopen::Duration::from_millis(1);

/// One of the two ends of the interface.
pub(crate) struct Port<U> {
    network: Arc<Mutex<Network<U>>>,
    /// A block upload was requested and not answered yet.
    uploading: Arc<AtomicBool>,
}

impl<U> Clone for Port<U> {
    fn clone(&self) -> Port<U> {
        Port { network: Arc::clone(&self.network), uploading: Arc::clone(&self.uploading) }
    }
}

impl<U> fmt::Debug for Port<U> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Port")
    }
}

impl<U: Unit> Port<U> {
    /// Powers the stations up; their boot-up messages are already on the bus.
    pub(crate) fn new(units: impl IntoIterator<Item = U>) -> Port<U> {
        let mut network = Network::new(units);
        network.start();
        Port { network: Arc::new(Mutex::new(network)), uploading: Arc::default() }
    }

    /// Calls `look` with the network, to inspect the nodes.
    pub(crate) fn with<R>(&self, look: impl FnOnce(&mut Network<U>) -> R) -> R {
        look(&mut self.network.lock().expect("nobody panics with the lock"))
    }

    /// Removes the size flag from a response. zencan 0.0.5 takes the size flag of the response that begins a block
    /// upload (CiA 301, 7.2.4.3.13, bit 1 of the first byte) for a part of its subcommand, and aborts.
    fn without_size_flag(&self, frame: Frame) -> Frame {
        let mut data: Vec<u8> = frame.data().to_vec();
        if frame.id() & 0x780 == 0x580 && self.uploading.swap(false, Ordering::Relaxed) && data[0] >> 5 == 6 {
            data[0] &= !0x02;
        }
        Frame::new(frame.id(), &data).expect("as long as before")
    }

    /// Advances the bus to its next event, and the clock with it.
    async fn step(&self) {
        let passed = self.with(|network| {
            let before = network.now();
            network.step(before + canbus::Time::from_micros(STEP.0));
            network.now() - before
        });
        tokio::time::advance(Duration::from_micros(passed.as_micros())).await;
    }
}

/// The frame could not be sent because it is no CANopen frame.
#[derive(Debug)]
pub(crate) struct Refused(CanMessage);

impl CanSendError for Refused {
    fn into_can_message(self) -> CanMessage {
        self.0
    }

    fn message(&self) -> String {
        "no frame of CANopen".into()
    }
}

impl<U: Unit + Send> AsyncCanSender for Port<U> {
    type Error = Refused;

    async fn send(&mut self, message: CanMessage) -> Result<(), Refused> {
        let frame = match message.id {
            CanId::Std(id) if message.rtr => Frame::remote(id, message.dlc),
            CanId::Std(id) => Frame::new(id, message.data()),
            CanId::Extended(_) => None,
        };
        let frame = frame.ok_or(Refused(message))?;
        if frame.id() & 0x780 == 0x600 {
            self.uploading.store(frame.data()[0] & 0xE3 == 0xA0, Ordering::Relaxed);
        }
        self.with(|network| network.send(&frame));
        Ok(())
    }
}

impl<U: Unit + Send> AsyncCanReceiver for Port<U> {
    type Error = Refused;

    fn try_recv(&mut self) -> Option<CanMessage> {
        let frame = self.with(|network| network.hear().and_then(|heard| from_bus(&heard.frame)))?;
        let frame = self.without_size_flag(frame);
        Some(CanMessage::new(CanId::std(frame.id()), frame.data()))
    }

    async fn recv(&mut self) -> Result<CanMessage, Refused> {
        loop {
            if let Some(message) = self.try_recv() {
                return Ok(message);
            }
            self.step().await;
        }
    }
}
