//! Sockets and threads: they only move bytes, everything that decides runs in the world's thread.

use std::io::{self, Read, Write};
use std::net::{Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, SyncSender, sync_channel};
use std::thread;
use std::time::Duration;

use canbus::Frame;

use super::Protocol;

/// Names a client for as long as the program runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct ClientId(u32);

impl ClientId {
    /// A number not used before.
    pub(super) fn next(counter: &AtomicU32) -> ClientId {
        ClientId(counter.fetch_add(1, Ordering::Relaxed))
    }
}

/// What the threads tell the world.
#[derive(Debug)]
pub(super) enum Event {
    Connected {
        client: ClientId,
        protocol: Protocol,
        output: SyncSender<Output>,
    },
    Bytes(ClientId, Vec<u8>),
    /// From a SocketCAN interface, which carries frames and no text.
    Frame(ClientId, Frame),
    Closed(ClientId),
}

/// What the world tells a client.
#[derive(Debug)]
pub(super) enum Output {
    /// In a segment of its own.
    Segment(String),
    /// Joined with its neighbours.
    Stream(String),
}

/// Messages that may wait for a slow client. Like the queue of a kernel's CAN socket it loses what comes on top.
const BACKLOG: usize = 16_384;

/// How long a segment stands alone. TCP keeps no message boundaries, and python-can takes whatever one `recv`
/// returns for the answer: nothing may follow the answer before the client has read it.
const SEGMENT_GAP: Duration = Duration::from_millis(50);

/// Accepts clients until the program ends. Returns the address, which tells the port when 0 was asked for.
pub(super) fn listen(
    address: SocketAddr,
    protocol: Protocol,
    events: Sender<Event>,
    counter: Arc<AtomicU32>,
) -> io::Result<SocketAddr> {
    let listener = TcpListener::bind(address)?;
    let bound = listener.local_addr()?;
    thread::spawn(move || {
        for stream in listener.incoming().flatten() {
            let client = ClientId::next(&counter);
            // A client that is gone before it was served is not an event.
            let _ = serve(stream, client, protocol, &events);
        }
    });
    Ok(bound)
}

fn serve(stream: TcpStream, client: ClientId, protocol: Protocol, events: &Sender<Event>) -> io::Result<()> {
    stream.set_nodelay(true)?;
    let (output, messages) = sync_channel(BACKLOG);
    let (reader, events) = (stream.try_clone()?, events.clone());
    // The world must hear of the client before it hears from it.
    if events.send(Event::Connected { client, protocol, output }).is_ok() {
        thread::spawn(move || write_all(stream, &messages));
        thread::spawn(move || read_all(reader, client, &events));
    }
    Ok(())
}

fn read_all(mut stream: TcpStream, client: ClientId, events: &Sender<Event>) {
    let mut buffer = [0; 4096];
    while let Ok(count @ 1..) = stream.read(&mut buffer) {
        if events.send(Event::Bytes(client, buffer[..count].to_vec())).is_err() {
            return;
        }
    }
    let _ = events.send(Event::Closed(client));
}

/// Ends when the world has dropped its side of the channel, or the client is gone.
fn write_all(mut stream: TcpStream, messages: &Receiver<Output>) {
    while let Ok(message) = messages.recv() {
        if write_some(&mut stream, message, messages).is_err() {
            break;
        }
    }
    let _ = stream.shutdown(Shutdown::Both);
}

/// Writes a message and what can be joined to it.
fn write_some(stream: &mut TcpStream, message: Output, messages: &Receiver<Output>) -> io::Result<()> {
    let mut joined = String::new();
    let mut next = Some(message);
    while let Some(message) = next {
        match message {
            Output::Stream(text) => joined.push_str(&text),
            Output::Segment(text) => {
                stream.write_all(joined.as_bytes())?;
                joined.clear();
                stream.write_all(text.as_bytes())?;
                thread::sleep(SEGMENT_GAP);
            }
        }
        next = messages.try_recv().ok();
    }
    stream.write_all(joined.as_bytes())
}
