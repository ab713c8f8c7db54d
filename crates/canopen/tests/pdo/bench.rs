//! A device without an application, and a queue that keeps all frames.

use canopen::sdo::Multiplexer;
use canopen::{Application, Definition, Device, Frame, Instant, QueueFull, Transmit};

use crate::exchange;

/// The node-ID of the devices.
pub(crate) const ID: u8 = 5;

pub(crate) struct Nothing;

impl Application for Nothing {}

/// All frames sent.
#[derive(Default)]
pub(crate) struct Sent(pub(crate) Vec<Frame>);

/// All frames sent, by a queue that has room for this number of frames.
pub(crate) struct Short {
    pub(crate) sent: Vec<Frame>,
    pub(crate) room: usize,
}

impl Transmit for Short {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.room = self.room.checked_sub(1).ok_or(QueueFull)?;
        self.sent.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        self.room
    }
}

impl Transmit for Sent {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

/// Writes a value by SDO; the abort code if the device refuses.
pub(crate) fn download<D: Definition>(
    device: &mut Device<D>,
    (index, sub): (u16, u8),
    bytes: &[u8],
    now: Instant,
) -> Result<(), u32> {
    exchange::write(ID, Multiplexer { index, sub }, bytes, |request| {
        let mut sent = Sent::default();
        let _ = device.on_service_frame(&request, now, &mut sent);
        sent.0
    })
}
