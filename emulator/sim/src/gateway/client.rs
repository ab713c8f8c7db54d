//! One client over TCP: its connection, its session, and its adapter on the bus.

use std::io::{ErrorKind, Read};
use std::time::Instant;

use canbus::Stamped;
use mio::net::TcpStream;

use super::outbox::Outbox;
use super::session::{Action, Session};
use crate::world::{PortId, World};

/// Maximum number of a client's bytes to process in one step of the world: more frames than the bus carries in that
/// time.
const SHARE: usize = 1024;

/// Maximum number of a client's frames that wait for the bus. While the queue is full, nothing more is read from the
/// client.
const QUEUE: usize = 64;

/// A client and the state of its connection.
pub(super) struct Client {
    stream: TcpStream,
    session: Box<dyn Session>,
    port: PortId,
    outbox: Outbox,
    /// The host may have bytes to read, or space to write.
    readable: bool,
    writable: bool,
    /// The client sends no more; its earlier frames still go out.
    leaving: bool,
    /// The client receives no more.
    deaf: bool,
}

impl Client {
    /// Greets a client that has just connected.
    pub(super) fn new(
        stream: TcpStream,
        mut session: Box<dyn Session>,
        port: PortId,
        world: &mut World,
    ) -> Client {
        let mut greeting = Vec::new();
        session.greet(&mut greeting);
        let outbox = Outbox::default();
        let mut client = Client {
            stream,
            session,
            port,
            outbox,
            readable: true,
            writable: true,
            leaving: false,
            deaf: false,
        };
        client.act(greeting, world);
        client
    }

    /// The host reports that the connection is readable or writable.
    pub(super) fn wake(&mut self, readable: bool, writable: bool) {
        self.readable |= readable;
        self.writable |= writable;
    }

    /// Processes the client's share of received bytes.
    pub(super) fn listen(&mut self, world: &mut World) {
        let has_room = self.outbox.has_room() && world.port(self.port).backlog() < QUEUE;
        if !self.readable || !has_room || self.leaving {
            return;
        }
        let mut bytes = [0; SHARE];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.leaving = true,
            Ok(count) => {
                self.outbox.heard();
                let mut actions = Vec::new();
                self.session.on_bytes(&bytes[..count], &mut actions);
                self.act(actions, world);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => self.readable = false,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => self.leaving = true,
        }
    }

    fn act(&mut self, actions: Vec<Action>, world: &mut World) {
        let now = world.now();
        for action in actions {
            match action {
                Action::Segment(text) => self.outbox.segment(&text),
                Action::Stream(text) => self.outbox.stream(&text),
                Action::Attach(adapter) => world.port(self.port).attach(Some(adapter)),
                Action::Detach => world.port(self.port).detach_when_sent(),
                Action::Send(frame) => world.port(self.port).send(frame, now),
                Action::Close => self.leaving = true,
            }
        }
    }

    /// Passes on the frames since the last call; returns the number of frames lost because the client was too slow.
    pub(super) fn tell(&mut self, world: &mut World, now: Instant) -> u64 {
        let mut lost = 0;
        while let Some(Stamped { at, frame }) = world.port(self.port).receive() {
            let Some(text) = self.session.on_frame(&frame, at).filter(|_| !self.deaf) else { continue };
            if self.outbox.has_room() {
                self.outbox.stream(&text);
            } else {
                lost += 1;
            }
        }
        self.flush(now);
        lost
    }

    fn flush(&mut self, now: Instant) {
        if !self.writable || self.deaf {
            return;
        }
        match self.outbox.flush(&mut self.stream, now) {
            Ok(()) => {}
            Err(error) if error.kind() == ErrorKind::WouldBlock => self.writable = false,
            Err(_) => (self.deaf, self.outbox) = (true, Outbox::default()),
        }
    }

    /// The port of a client that has left and has no more frames to send.
    pub(super) fn done(&self, world: &mut World) -> Option<PortId> {
        (self.leaving && world.port(self.port).backlog() == 0).then_some(self.port)
    }

    /// Drops frames that the bus does not take; returns their number.
    pub(super) fn give_up(&self, world: &mut World) -> u64 {
        let now = world.now();
        world.port(self.port).give_up(now)
    }
}
