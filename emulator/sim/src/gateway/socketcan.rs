//! A SocketCAN interface of the host as a client, so that candump and its kin see the bus.

use std::io;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use canbus::Frame;
use socketcan::{CanFrame, CanSocket, EmbeddedFrame, Socket};

use super::tcp::{ClientId, Event};

/// Frames that may wait for the interface.
const BACKLOG: usize = 16_384;

/// How long the kernel may take to accept a frame before it is given up.
const WRITE_TIMEOUT: Duration = Duration::from_millis(100);

/// Opens the interface and moves its frames; the sender takes those of the bus. Reading and writing share one
/// socket, because a socket does not hear what it has sent itself.
pub(super) fn open(
    interface: &str,
    client: ClientId,
    events: Sender<Event>,
) -> io::Result<SyncSender<Frame>> {
    let socket = Arc::new(CanSocket::open(interface)?);
    socket.set_write_timeout(WRITE_TIMEOUT)?;
    let (frames, queue) = sync_channel(BACKLOG);
    let reader = Arc::clone(&socket);
    thread::spawn(move || read_all(&reader, client, &events));
    thread::spawn(move || write_all(&socket, &queue));
    Ok(frames)
}

fn read_all(socket: &CanSocket, client: ClientId, events: &Sender<Event>) {
    while let Ok(frame) = socket.read_frame() {
        let Some(frame) = from_host(&frame) else { continue };
        if events.send(Event::Frame(client, frame)).is_err() {
            return;
        }
    }
    let _ = events.send(Event::Closed(client));
}

fn write_all(socket: &CanSocket, frames: &Receiver<Frame>) {
    while let Ok(frame) = frames.recv() {
        let Some(frame) = to_host(&frame) else { continue };
        // A full queue of the interface loses the frame, as it would for any other sender.
        let _ = socket.write_frame(&frame);
    }
}

/// `None` for an error frame, which tells of the host's interface and not of our bus.
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
