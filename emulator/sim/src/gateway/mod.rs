//! Programs outside that take part in the bus: over TCP, or through a SocketCAN interface of the host.
//!
//! Everything runs in the world's thread, between two of its steps, and nothing waits: a frame of a client enters the bus
//! at one defined instant of virtual time. A client has a queue of its own in each direction, both of them bounded, and a
//! share of each step. A client that sends faster than the bus takes it is not read from; one that does not read loses
//! frames. What a client has sent before it closed its connection still goes out.

mod client;
mod outbox;
mod session;
mod slcan;
#[cfg(target_os = "linux")]
mod socketcan;
mod socketcand;

use std::collections::BTreeMap;
use std::io::{self, ErrorKind};
use std::net::SocketAddr;
use std::time::{Duration, Instant};

use anyhow::{Context, Result};
use mio::net::{TcpListener, TcpStream};
use mio::{Events, Interest, Poll, Token};

use self::client::Client;
use self::session::Session;
use self::slcan::Slcan;
#[cfg(target_os = "linux")]
use self::socketcan::Interface;
use self::socketcand::Socketcand;
use crate::world::World;

/// The name of the bus for clients.
pub const BUS_NAME: &str = "vcan0";

/// Clients that are accepted in one step of the world.
const WELCOMED: usize = 16;

/// What is spoken on a TCP port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// The protocol of the socketcand daemon.
    Socketcand,
    /// The same, for the page in the browser: it only looks on when nodes boot.
    Page,
    /// The line protocol of LAWICEL adapters.
    Slcan,
}

/// All clients.
pub struct Gateway {
    poll: Poll,
    events: Events,
    listeners: BTreeMap<Token, Listener>,
    clients: BTreeMap<Token, Client>,
    #[cfg(target_os = "linux")]
    interface: Option<Interface>,
    /// What the next connection is called.
    next: Token,
    lost: u64,
}

/// A port that clients connect to.
struct Listener {
    socket: TcpListener,
    protocol: Protocol,
    /// Somebody may wait to be accepted.
    knocked: bool,
}

impl Gateway {
    /// No clients yet.
    ///
    /// # Errors
    /// When the host cannot watch connections.
    pub fn new() -> Result<Gateway> {
        Ok(Gateway {
            poll: Poll::new().context("cannot watch connections")?,
            events: Events::with_capacity(1024),
            listeners: BTreeMap::new(),
            clients: BTreeMap::new(),
            #[cfg(target_os = "linux")]
            interface: None,
            next: Token(0),
            lost: 0,
        })
    }

    /// Serves a protocol. Returns the address, which tells the port when 0 was asked for.
    ///
    /// # Errors
    /// When the address cannot be had; the message names it.
    pub fn listen(&mut self, address: SocketAddr, protocol: Protocol) -> Result<SocketAddr> {
        let name = self.name();
        let mut listen = || {
            let mut socket = TcpListener::bind(address)?;
            self.poll.registry().register(&mut socket, name, Interest::READABLE)?;
            let bound = socket.local_addr()?;
            self.listeners.insert(name, Listener { socket, protocol, knocked: true });
            io::Result::Ok(bound)
        };
        listen().with_context(|| format!("cannot listen on {address}"))
    }

    /// Attaches a SocketCAN interface of the host.
    ///
    /// # Errors
    /// When the host has no such interface; the message names it.
    #[cfg(target_os = "linux")]
    pub fn attach_interface(&mut self, name: &str, world: &mut World) -> Result<()> {
        let interface = Interface::open(name, world);
        self.interface = Some(interface.with_context(|| format!("cannot open the CAN interface {name}"))?);
        Ok(())
    }

    /// Attaches a SocketCAN interface of the host.
    ///
    /// # Errors
    /// Always: only Linux has them.
    #[cfg(not(target_os = "linux"))]
    pub fn attach_interface(&mut self, name: &str, _: &mut World) -> Result<()> {
        anyhow::bail!("cannot open the CAN interface {name}: only Linux has SocketCAN")
    }

    /// Frames that were lost because a client did not take them in time, or the bus did not take them from a client.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Clients that are connected, or have something left to send.
    pub fn clients(&self) -> usize {
        self.clients.len()
    }

    /// Lets clients come, go and send; what they send is requested at the world's present time.
    pub fn poll(&mut self, world: &mut World) {
        // Without a time limit of zero it would wait. A failure leaves everything for the next step.
        let _ = self.poll.poll(&mut self.events, Some(Duration::ZERO));
        for event in &self.events {
            if let Some(client) = self.clients.get_mut(&event.token()) {
                let gone = event.is_error() || event.is_read_closed();
                client.wake(event.is_readable() || gone, event.is_writable() || event.is_error());
            } else if let Some(listener) = self.listeners.get_mut(&event.token()) {
                listener.knocked = true;
            }
        }
        self.welcome(world);
        #[cfg(target_os = "linux")]
        self.interface.iter_mut().for_each(|interface| interface.listen(world));
        for client in self.clients.values_mut() {
            client.listen(world);
            self.lost += client.give_up(world);
        }
    }

    /// Tells the clients what was on the bus since the last call, and lets go of those that have left.
    pub fn deliver(&mut self, world: &mut World) {
        let now = Instant::now();
        #[cfg(target_os = "linux")]
        self.interface.iter_mut().for_each(|interface| self.lost += interface.tell(world));
        self.lost += self.clients.values_mut().map(|client| client.tell(world, now)).sum::<u64>();
        self.clients.retain(|_, client| {
            let done = client.done(world);
            done.into_iter().for_each(|port| world.close_port(port));
            done.is_none()
        });
    }

    /// Accepts those who wait at the doors.
    fn welcome(&mut self, world: &mut World) {
        let mut accepted = Vec::new();
        for listener in self.listeners.values_mut() {
            accepted.extend(std::iter::from_fn(|| listener.accept()).take(WELCOMED));
        }
        for (stream, protocol) in accepted {
            // A client that is gone before it was served is not an event.
            let _ = self.connect(stream, protocol, world);
        }
    }

    fn connect(&mut self, mut stream: TcpStream, protocol: Protocol, world: &mut World) -> io::Result<()> {
        stream.set_nodelay(true)?;
        let name = self.name();
        self.poll.registry().register(&mut stream, name, Interest::READABLE | Interest::WRITABLE)?;
        let session: Box<dyn Session> = match protocol {
            Protocol::Socketcand | Protocol::Page => Box::new(Socketcand::new(BUS_NAME, world.bit_rate())),
            Protocol::Slcan => Box::new(Slcan::new(world.bit_rate())),
        };
        let port = if protocol == Protocol::Page { world.open_looking_port() } else { world.open_port() };
        self.clients.insert(name, Client::new(stream, session, port, world));
        Ok(())
    }

    /// A name that no connection had before.
    fn name(&mut self) -> Token {
        self.next.0 += 1;
        self.next
    }
}

impl Listener {
    /// The next who waits. Where the host has no room for more, those who wait are looked at again in the next step.
    fn accept(&mut self) -> Option<(TcpStream, Protocol)> {
        let answer = self.knocked.then(|| self.socket.accept())?;
        self.knocked = !matches!(&answer, Err(error) if error.kind() == ErrorKind::WouldBlock);
        answer.ok().map(|(stream, _)| (stream, self.protocol))
    }
}
