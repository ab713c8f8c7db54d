//! A SocketCAN interface of this host.

use std::io::{self, ErrorKind};
use std::thread;
use std::time::Duration;

use canopen::embedded_can::{from_driver, to_driver};
use canopen::{Frame, Instant};
use socketcan::{CanErrorFrame, CanFrame, CanSocket, EmbeddedFrame, Socket, SocketOptions};

use super::stream::is_time_out;
use super::{Bus, BusError, Controller, Received, clock};

/// The shortest time-out of a read; 0 would mean no time-out.
const SHORTEST: Duration = Duration::from_millis(1);
/// The time before the next try when the queue of the interface is full (`ENOBUFS`). The queue holds ten frames by
/// default.
const FULL: Duration = Duration::from_millis(1);
/// The number of tries before the bus counts as lost, because no node acknowledges.
const TRIES: usize = 2000;

/// An open interface.
pub(super) struct SocketCan {
    socket: CanSocket,
    controller: Controller,
}

impl SocketCan {
    pub(super) fn open(interface: &str) -> io::Result<SocketCan> {
        let socket = CanSocket::open(interface)?;
        // Without error frames the interface has no statistics, and works.
        let error_frames = socket.set_error_filter_accept_all().ok().map(|()| 0);
        Ok(SocketCan { socket, controller: Controller { error_frames, ..Controller::default() } })
    }

    /// The next frame within this time. With a time of 0, a frame that is there already.
    fn read_within(&mut self, time: Duration) -> io::Result<CanFrame> {
        if !time.is_zero() {
            self.socket.set_read_timeout(time.max(SHORTEST))?;
            return self.socket.read_frame();
        }
        self.socket.set_nonblocking(true)?;
        let result = self.socket.read_frame();
        self.socket.set_nonblocking(false)?;
        result
    }
}

impl Bus for SocketCan {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        let Some(frame) = to_driver::<CanFrame>(frame) else { return Ok(()) };
        for _ in 0..TRIES {
            match self.socket.write_frame(&frame) {
                Err(error) if is_full(&error) => thread::sleep(FULL),
                result => return result.map_err(BusError::Lost),
            }
        }
        Err(BusError::Lost(io::Error::new(ErrorKind::TimedOut, "the queue of the interface stays full")))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        loop {
            match self.read_within(clock::left(until)) {
                Ok(CanFrame::Error(error)) => on_error(&mut self.controller, &error),
                Ok(frame) => {
                    if let Some(frame) = from_host(&frame) {
                        return Ok(Some(Received { frame, at: self.now() }));
                    }
                }
                Err(error) if is_time_out(&error) => (),
                Err(error) => return Err(BusError::Lost(error)),
            }
            if self.now() >= until {
                return Ok(None);
            }
        }
    }

    fn controller(&mut self) -> Controller {
        self.controller
    }
}

fn on_error(controller: &mut Controller, error: &CanErrorFrame) {
    controller.on_error_frame(error.error_bits(), error.data());
}

fn is_full(error: &io::Error) -> bool {
    const ENOBUFS: i32 = 105;
    error.raw_os_error() == Some(ENOBUFS) || error.kind() == ErrorKind::WouldBlock
}

/// The frame; `None` for a 29-bit identifier and for an error frame.
fn from_host(frame: &CanFrame) -> Option<Frame> {
    if matches!(frame, CanFrame::Error(_)) { None } else { from_driver(frame) }
}

#[cfg(test)]
mod tests {
    use socketcan::ExtendedId;

    use super::*;

    #[test]
    fn base_frames_cross_unchanged_and_extended_ones_do_not() {
        let frames = [Frame::new(0x181, &[1, 2, 3]), Frame::new(0x7FF, &[]), Frame::remote(0x701, 8)];
        for frame in frames.map(Option::unwrap) {
            assert_eq!(from_host(&to_driver(&frame).unwrap()), Some(frame));
        }
        let extended = CanFrame::new(ExtendedId::new(0x181).unwrap(), &[1]).unwrap();
        assert_eq!(from_host(&extended), None);
    }

    #[test]
    fn an_error_frame_is_counted_with_its_error_counters() {
        let mut controller = Controller::default();
        // A bus error with counters: classes 80h and 200h.
        let error = CanErrorFrame::new_error(0x280, &[0, 0, 0, 0, 0, 0, 8, 1]).unwrap();
        on_error(&mut controller, &error);
        let expected = Controller {
            error_frames: Some(1),
            transmit_errors: Some(8),
            receive_errors: Some(1),
            ..Controller::default()
        };
        assert_eq!(controller, expected);
    }
}
