//! A device without an application, a queue that keeps what it is given, and a client.

use canopen::sdo::{Bytes, Initiate, Multiplexer, Request, Response};
use canopen::{Application, Device, Frame, Instant, QueueFull, Transmit};

/// The node-ID of the devices.
pub(crate) const ID: u8 = 5;

pub(crate) struct Nothing;

impl Application for Nothing {}

/// Everything that was sent.
#[derive(Default)]
pub(crate) struct Sent(pub(crate) Vec<Frame>);

impl Transmit for Sent {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

/// Writes up to four bytes by SDO; the abort code where the device refuses them.
pub(crate) fn download<
    A: Application,
    const N: usize,
    const T: usize,
    const R: usize,
    const W: usize,
    const M: usize,
>(
    device: &mut Device<A, N, T, R, W, M>,
    (index, sub): (u16, u8),
    bytes: &[u8],
    now: Instant,
) -> Result<(), u32> {
    let at = Multiplexer { index, sub };
    let request = Request::Download(at, Initiate::Expedited(Bytes::from_slice(bytes)));
    let mut sent = Sent::default();
    let frame = Frame::new(0x600 + u16::from(ID), &request.encode()).unwrap();
    let _ = device.on_service_frame(&frame, now, &mut sent);
    let response = sent.0.iter().find(|frame| frame.id() == 0x580 + u16::from(ID)).unwrap();
    match Response::parse(response.data().try_into().unwrap()) {
        Some(Response::Downloaded(_)) => Ok(()),
        Some(Response::Abort(_, code)) => Err(code),
        other => panic!("{other:?}"),
    }
}
