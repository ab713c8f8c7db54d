//! The control connection: programs set and read the stimuli of the sensors over TCP.
//!
//! A line of text is a command, as typed on the terminal; the answer is a line of JSON. `boards` returns all stimuli.
//! After `watch` a client gets them whenever a stimulus has changed, and once a second. All connections are served in
//! the world's thread, between two steps, without waiting.

use std::io::{self, ErrorKind, Read as _, Write as _};
use std::net::{SocketAddr, TcpListener, TcpStream};

use anyhow::{Context, Result};
use canbus::Time;
use chip::plant::FaultKind;
use serde_json::{Value, json};

use crate::console::{self, Command};
use crate::world::World;

/// Maximum number of simultaneous connections.
const CLIENTS: usize = 16;
/// Maximum length of a command in bytes.
const LINE: usize = 1024;
/// Maximum number of bytes that may wait for a client; a client that does not read is disconnected.
const WAITING: usize = 256 * 1024;
/// Period of reports to watching clients without a change of a stimulus: the value of a sine changes all the time.
const PERIOD: Time = Time::from_millis(1000);

/// The listening port and the clients.
pub struct Control {
    listener: TcpListener,
    clients: Vec<Client>,
    /// The number of the last reported change, and the instant of the report.
    told: (u64, Time),
}

/// A connection.
struct Client {
    stream: TcpStream,
    unread: Vec<u8>,
    unsent: Vec<u8>,
    watches: bool,
    has_spoken: bool,
    is_gone: bool,
}

impl Control {
    /// Listens on an address. Port 0 takes a free port.
    ///
    /// # Errors
    /// When the address is not available; the message names the address.
    pub fn listen(address: SocketAddr) -> Result<Control> {
        let listen = || {
            let listener = TcpListener::bind(address)?;
            listener.set_nonblocking(true)?;
            io::Result::Ok(listener)
        };
        let listener = listen().with_context(|| format!("cannot listen on {address}"))?;
        Ok(Control { listener, clients: Vec::new(), told: (0, Time::ZERO) })
    }

    /// The address of the listening port.
    ///
    /// # Errors
    /// When the host does not return the address.
    pub fn address(&self) -> Result<SocketAddr> {
        self.listener.local_addr().context("the control connection has no address")
    }

    /// Serves all clients. Returns whether a client has requested the end of the run.
    pub fn poll(&mut self, world: &mut World) -> bool {
        while self.clients.len() < CLIENTS
            && let Ok((stream, _)) = self.listener.accept()
        {
            self.clients.extend(Client::new(stream));
        }
        let mut quit = false;
        for client in &mut self.clients {
            client.listen(|line| obey(line, world, &mut quit));
        }
        self.tell(world);
        self.clients.iter_mut().for_each(Client::flush);
        self.clients.retain(|client| !client.is_gone);
        quit
    }

    /// Reports the stimuli to the watching clients.
    fn tell(&mut self, world: &World) {
        let (changes, at) = self.told;
        let is_due = world.stimuli_changes() != changes || world.now().since(at) >= PERIOD;
        if is_due && self.clients.iter().any(|client| client.watches) {
            self.told = (world.stimuli_changes(), world.now());
            let line = boards(world).to_string();
            self.clients.iter_mut().filter(|client| client.watches).for_each(|client| client.say(&line));
        }
    }
}

/// The answer to a line.
enum Answer {
    Line(Value),
    /// An answer, and further reports from now on.
    Watch(Value),
    /// The line is no command of this connection.
    No(String),
}

fn obey(line: &str, world: &mut World, quit: &mut bool) -> Option<Answer> {
    let done = || Answer::Line(json!({ "ok": true }));
    Some(match line.trim() {
        "boards" => Answer::Line(boards(world)),
        "watch" => Answer::Watch(boards(world)),
        // A program at the connection must not read the files of this machine, and reading delays the simulation.
        line if line.contains("csv:") => {
            Answer::Line(json!({ "error": "csv: is for the command line of the simulator" }))
        }
        line => match console::parse(line, &["boards", "watch"])? {
            Ok(Command::Quit) => {
                *quit = true;
                done()
            }
            Ok(Command::Stimulus(stimulus)) => match world.apply(&stimulus) {
                Ok(()) => done(),
                Err(error) => Answer::Line(json!({ "error": error.to_string() })),
            },
            Err(error) => Answer::No(error),
        },
    })
}

/// All stimuli, and the names of all faults.
fn boards(world: &World) -> Value {
    let faults: Vec<Value> =
        FaultKind::all().map(|kind| json!({ "name": kind.name(), "text": kind.text() })).collect();
    json!({
        "t": world.now().as_secs_f64(), "bit_rate": world.bit_rate() / 1000,
        "boards": world.stimuli(), "faults": faults,
    })
}

impl Client {
    fn new(stream: TcpStream) -> Option<Client> {
        stream.set_nonblocking(true).ok()?;
        stream.set_nodelay(true).ok()?;
        Some(Client {
            stream,
            unread: Vec::new(),
            unsent: Vec::new(),
            watches: false,
            has_spoken: false,
            is_gone: false,
        })
    }

    /// Processes the received lines.
    fn listen(&mut self, mut obey: impl FnMut(&str) -> Option<Answer>) {
        let mut bytes = [0; LINE];
        match self.stream.read(&mut bytes) {
            Ok(0) => self.is_gone = true,
            Ok(count) => self.unread.extend(&bytes[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(_) => self.is_gone = true,
        }
        while let Some(end) = self.unread.iter().position(|&byte| byte == b'\n') {
            let line: Vec<u8> = self.unread.drain(..=end).collect();
            match obey(&String::from_utf8_lossy(&line)) {
                Some(Answer::Line(answer)) => self.say(&answer.to_string()),
                Some(Answer::Watch(answer)) => {
                    self.watches = true;
                    self.say(&answer.to_string());
                }
                Some(Answer::No(error)) => {
                    self.say(&json!({ "error": error }).to_string());
                    // A web page can make a browser send a request to this port. Such a request does not begin with a
                    // command.
                    if !self.has_spoken {
                        return self.leave();
                    }
                }
                None => continue,
            }
            self.has_spoken = true;
        }
        if self.unread.len() > LINE {
            self.leave();
        }
    }

    fn say(&mut self, line: &str) {
        self.unsent.extend(line.as_bytes());
        self.unsent.push(b'\n');
    }

    fn leave(&mut self) {
        self.flush();
        self.is_gone = true;
    }

    /// Writes as much as the client accepts.
    fn flush(&mut self) {
        while !self.unsent.is_empty() && !self.is_gone {
            match self.stream.write(&self.unsent) {
                Ok(0) => self.is_gone = true,
                Ok(count) => drop(self.unsent.drain(..count)),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(_) => self.is_gone = true,
            }
        }
        self.is_gone |= self.unsent.len() > WAITING;
    }
}
