//! A SocketCAN interface of the host as a client, so that candump and similar tools see the bus.

use std::collections::VecDeque;
use std::io;

use canbus::Frame;
use socketcan::{CanFrame, CanSocket, EmbeddedFrame, Socket};

use crate::port::Adapter;
use crate::world::{PortId, World};

/// Maximum number of frames that wait for the interface; further frames are lost.
const MOST: usize = 1024;

/// Maximum number of the interface's frames that wait for the bus. While the queue is full, nothing more is read.
const QUEUE: usize = 64;

/// An interface. Reading and writing share one socket, because a socket does not receive the frames that it has sent.
pub(super) struct Interface {
    socket: CanSocket,
    port: PortId,
    waiting: VecDeque<CanFrame>,
}

impl Interface {
    /// Opens an interface and a port on the bus.
    pub(super) fn open(name: &str, world: &mut World) -> io::Result<Interface> {
        let socket = CanSocket::open(name)?;
        socket.set_nonblocking(true)?;
        let (port, bit_rate) = (world.open_port(), world.bit_rate());
        world.port(port).attach(Some(Adapter { bit_rate, silent: false }));
        Ok(Interface { socket, port, waiting: VecDeque::new() })
    }

    /// Sends the frames of the host's programs.
    pub(super) fn listen(&mut self, world: &mut World) {
        let now = world.now();
        while world.port(self.port).backlog() < QUEUE
            && let Ok(frame) = self.socket.read_frame()
        {
            from_host(&frame).into_iter().for_each(|frame| world.port(self.port).send(frame, now));
        }
    }

    /// Passes frames to the host; returns the number of frames that the host or the bus did not take in time.
    pub(super) fn tell(&mut self, world: &mut World) -> u64 {
        let now = world.now();
        let mut lost = world.port(self.port).give_up(now);
        while let Some(stamped) = world.port(self.port).receive() {
            match to_host(&stamped.frame).filter(|_| self.waiting.len() < MOST) {
                Some(frame) => self.waiting.push_back(frame),
                None => lost += 1,
            }
        }
        while let Some(frame) = self.waiting.front()
            && self.socket.write_frame(frame).is_ok()
        {
            self.waiting.pop_front();
        }
        lost
    }
}

/// `None` for an error frame, which describes the host's interface and not this bus.
fn from_host(frame: &CanFrame) -> Option<Frame> {
    match frame {
        CanFrame::Data(frame) => Frame::data(frame.id(), frame.data()),
        CanFrame::Remote(frame) => Frame::remote(frame.id(), u8::try_from(frame.dlc()).ok()?),
        CanFrame::Error(_) => None,
    }
}

fn to_host(frame: &Frame) -> Option<CanFrame> {
    if frame.is_remote() {
        CanFrame::new_remote(frame.id(), usize::from(frame.dlc()))
    } else {
        CanFrame::new(frame.id(), frame.bytes())
    }
}

#[cfg(test)]
mod tests {
    use canbus::{ExtendedId, StandardId};

    use super::*;

    #[test]
    fn frames_cross_unchanged_in_both_directions() {
        let standard = StandardId::new(0x181).unwrap();
        let extended = ExtendedId::new(0x1ABC_DEF0).unwrap();
        let frames = [
            Frame::data(standard, &[1, 2, 3]),
            Frame::data(extended, &[]),
            Frame::remote(standard, 8),
            Frame::remote(extended, 0),
        ];
        for frame in frames.map(Option::unwrap) {
            assert_eq!(from_host(&to_host(&frame).unwrap()), Some(frame));
        }
    }
}
