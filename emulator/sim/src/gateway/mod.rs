//! Programs outside that take part in the bus: over TCP, or through a SocketCAN interface of the host.
//!
//! Threads move bytes between sockets and channels. The protocols run in the world's thread, between two of its
//! steps, so a frame of a client enters the bus at one defined instant of virtual time.

mod session;
mod slcan;
#[cfg(target_os = "linux")]
mod socketcan;
mod socketcand;
mod tcp;

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::AtomicU32;
use std::sync::mpsc::{Receiver, Sender, SyncSender, channel};

use anyhow::{Context, Result};
use canbus::{Frame, Stamped, Time};

use self::session::{Action, Session};
use self::slcan::Slcan;
use self::socketcand::Socketcand;
use self::tcp::{ClientId, Event, Output};
use crate::port::Adapter;
use crate::world::{PortId, World};

/// The name of the bus for clients.
pub const BUS_NAME: &str = "vcan0";

/// What is spoken on a TCP port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// The protocol of the socketcand daemon.
    Socketcand,
    /// The line protocol of LAWICEL adapters.
    Slcan,
}

/// All clients.
pub struct Gateway {
    events: Receiver<Event>,
    /// For the threads of further listeners.
    sender: Sender<Event>,
    counter: Arc<AtomicU32>,
    clients: BTreeMap<ClientId, Client>,
    lost: u64,
}

/// One client and its adapter on the bus.
struct Client {
    port: PortId,
    link: Link,
}

enum Link {
    Text { session: Box<dyn Session>, output: SyncSender<Output> },
    Frames(SyncSender<Frame>),
}

impl Default for Gateway {
    /// No clients yet.
    fn default() -> Gateway {
        let (sender, events) = channel();
        Gateway { events, sender, counter: Arc::default(), clients: BTreeMap::new(), lost: 0 }
    }
}

impl Gateway {
    /// Serves a protocol. Returns the address, which tells the port when 0 was asked for.
    pub fn listen(&self, address: SocketAddr, protocol: Protocol) -> Result<SocketAddr> {
        tcp::listen(address, protocol, self.sender.clone(), Arc::clone(&self.counter))
            .with_context(|| format!("cannot listen on {address}"))
    }

    /// Attaches a SocketCAN interface of the host.
    #[cfg(target_os = "linux")]
    pub fn attach_interface(&mut self, interface: &str, world: &mut World) -> Result<()> {
        let id = ClientId::next(&self.counter);
        let frames = socketcan::open(interface, id, self.sender.clone())
            .with_context(|| format!("cannot open the CAN interface {interface}"))?;
        let port = world.open_port();
        let bit_rate = world.bit_rate();
        world.port(port).attach(Some(Adapter { bit_rate, silent: false }));
        self.clients.insert(id, Client { port, link: Link::Frames(frames) });
        Ok(())
    }

    /// Attaches a SocketCAN interface of the host.
    #[cfg(not(target_os = "linux"))]
    pub fn attach_interface(&mut self, interface: &str, _: &mut World) -> Result<()> {
        anyhow::bail!("cannot open the CAN interface {interface}: only Linux has SocketCAN")
    }

    /// Frames that were lost because a client did not take them in time.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Lets clients come, go and send; what they send is requested at the world's present time.
    pub fn poll(&mut self, world: &mut World) {
        while let Ok(event) = self.events.try_recv() {
            match event {
                Event::Connected { client, protocol, output } => {
                    self.connect(client, protocol, output, world)
                }
                Event::Bytes(client, bytes) => {
                    self.act(client, world, |session, out| session.on_bytes(&bytes, out))
                }
                Event::Frame(client, frame) => self.send(client, frame, world),
                Event::Closed(client) => self.close(client, world),
            }
        }
    }

    /// Tells the clients what was on the bus since the last call.
    pub fn deliver(&mut self, world: &mut World) {
        for client in self.clients.values_mut() {
            while let Some(Stamped { at, frame }) = world.port(client.port).receive() {
                self.lost += u64::from(!client.link.deliver(&frame, at));
            }
        }
    }

    fn connect(&mut self, id: ClientId, protocol: Protocol, output: SyncSender<Output>, world: &mut World) {
        let session: Box<dyn Session> = match protocol {
            Protocol::Socketcand => Box::new(Socketcand::new(BUS_NAME, world.bit_rate())),
            Protocol::Slcan => Box::new(Slcan::new(world.bit_rate())),
        };
        let client = Client { port: world.open_port(), link: Link::Text { session, output } };
        self.clients.insert(id, client);
        self.act(id, world, |session, out| session.greet(out));
    }

    /// Lets a session speak and does what it wants.
    fn act(
        &mut self,
        id: ClientId,
        world: &mut World,
        speak: impl FnOnce(&mut dyn Session, &mut Vec<Action>),
    ) {
        let Some(Client { port, link: Link::Text { session, output } }) = self.clients.get_mut(&id) else {
            return;
        };
        let mut actions = Vec::new();
        speak(session.as_mut(), &mut actions);
        for action in actions {
            let now = world.now();
            match action {
                Action::Segment(text) => drop(output.try_send(Output::Segment(text))),
                Action::Stream(text) => drop(output.try_send(Output::Stream(text))),
                Action::Attach(adapter) => world.port(*port).attach(Some(adapter)),
                Action::Detach => world.port(*port).attach(None),
                Action::Send(frame) => world.port(*port).send(frame, now),
            }
        }
    }

    fn send(&mut self, id: ClientId, frame: Frame, world: &mut World) {
        if let Some(client) = self.clients.get(&id) {
            let now = world.now();
            world.port(client.port).send(frame, now);
        }
    }

    fn close(&mut self, id: ClientId, world: &mut World) {
        if let Some(client) = self.clients.remove(&id) {
            world.close_port(client.port);
        }
    }
}

impl Link {
    /// Whether the client could take the frame, or has no use for it.
    fn deliver(&mut self, frame: &Frame, at: Time) -> bool {
        match self {
            Link::Frames(frames) => frames.try_send(*frame).is_ok(),
            Link::Text { session, output } => {
                session.on_frame(frame, at).is_none_or(|text| output.try_send(Output::Stream(text)).is_ok())
            }
        }
    }
}
