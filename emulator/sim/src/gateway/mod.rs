//! Network clients of the bus: over TCP, or through a SocketCAN interface of the host.
//!
//! All clients are served in the world's thread, between two of its steps, without waiting. So a frame of a client
//! enters the bus at one defined instant of virtual time. Each client has a bounded queue in each direction, and a
//! share of each step. The gateway stops reading from a client that sends faster than the bus; a client that does not
//! read loses frames. Frames that a client has sent before it closed its connection still go out.

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

/// Maximum number of clients to accept in one step of the world, for each port.
const WELCOMED: usize = 16;

/// The protocol of a TCP port.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Protocol {
    /// The protocol of the socketcand daemon.
    Socketcand,
    /// The socketcand protocol for the page in the browser, which does not start nodes that boot.
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
    /// The token of the last connection.
    next: Token,
    lost: u64,
}

/// A port that clients connect to.
struct Listener {
    socket: TcpListener,
    protocol: Protocol,
    /// A client may wait to be accepted.
    knocked: bool,
}

impl Gateway {
    /// A gateway without clients.
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

    /// Serves a protocol at an address. Returns the address with the actual port, which differs if port 0 was
    /// requested.
    ///
    /// # Errors
    /// When the address is not available; the message names the address.
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
    /// When the host has no such interface; the message names the interface.
    #[cfg(target_os = "linux")]
    pub fn attach_interface(&mut self, name: &str, world: &mut World) -> Result<()> {
        let interface = Interface::open(name, world);
        self.interface = Some(interface.with_context(|| format!("cannot open the CAN interface {name}"))?);
        Ok(())
    }

    /// Attaches a SocketCAN interface of the host.
    ///
    /// # Errors
    /// Always: only Linux has SocketCAN interfaces.
    #[cfg(not(target_os = "linux"))]
    pub fn attach_interface(&mut self, name: &str, _: &mut World) -> Result<()> {
        anyhow::bail!("cannot open the CAN interface {name}: only Linux has SocketCAN")
    }

    /// Number of lost frames: not read by a client in time, or not taken by the bus.
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Number of clients that are connected or still have frames to send.
    pub fn clients(&self) -> usize {
        self.clients.len()
    }

    /// Accepts clients and processes their input; their frames are requested at the current time of the world.
    pub fn poll(&mut self, world: &mut World) {
        // The time limit of zero prevents waiting. After a failure the events are handled in the next step.
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

    /// Passes the frames since the last call to the clients, and removes the clients that have left.
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

    /// Accepts waiting clients.
    fn welcome(&mut self, world: &mut World) {
        let mut accepted = Vec::new();
        for listener in self.listeners.values_mut() {
            accepted.extend(std::iter::from_fn(|| listener.accept()).take(WELCOMED));
        }
        for (stream, protocol) in accepted {
            // A client that has left before it was served is no error.
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

    /// A token that no connection had before.
    fn name(&mut self) -> Token {
        self.next.0 += 1;
        self.next
    }
}

impl Listener {
    /// The next waiting client. If the host refuses for lack of resources, the waiting clients are accepted in a later
    /// step.
    fn accept(&mut self) -> Option<(TcpStream, Protocol)> {
        let answer = self.knocked.then(|| self.socket.accept())?;
        self.knocked = !matches!(&answer, Err(error) if error.kind() == ErrorKind::WouldBlock);
        answer.ok().map(|(stream, _)| (stream, self.protocol))
    }
}
