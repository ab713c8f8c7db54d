//! The smallest client of a socketcand server (<https://github.com/linux-can/socketcand>): frames as text over TCP.

mod run;

pub(crate) use run::{Product, run};

use std::fmt::Write as _;
use std::io::{self, ErrorKind, Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use canopen::{Frame, QueueFull, Transmit};

/// A connection in raw mode: every frame of the bus is reported.
pub(crate) struct Bus {
    stream: TcpStream,
    text: String,
}

impl Bus {
    /// Opens a bus of the server at `address`, `host:port`.
    pub(crate) fn open(address: &str, bus: &str) -> io::Result<Bus> {
        let mut bus_of = Bus { stream: TcpStream::connect(address)?, text: String::new() };
        bus_of.stream.set_nodelay(true)?;
        bus_of.message(Duration::from_secs(3))?;
        for command in [format!("< open {bus} >"), "< rawmode >".to_owned()] {
            bus_of.stream.write_all(command.as_bytes())?;
            bus_of.message(Duration::from_secs(3))?;
        }
        Ok(bus_of)
    }

    /// The next base frame; `None` if none arrives in this time.
    pub(crate) fn receive(&mut self, patience: Duration) -> io::Result<Option<Frame>> {
        Ok(self.message(patience)?.as_deref().and_then(parse))
    }

    /// The next message, without its brackets.
    fn message(&mut self, patience: Duration) -> io::Result<Option<String>> {
        if !self.text.contains('>') {
            let mut bytes = [0; 1024];
            self.stream.set_read_timeout(Some(patience.max(Duration::from_micros(1))))?;
            match self.stream.read(&mut bytes) {
                Ok(0) => return Err(ErrorKind::ConnectionAborted.into()),
                Ok(len) => self.text.push_str(&String::from_utf8_lossy(&bytes[..len])),
                Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => (),
                Err(error) => return Err(error),
            }
        }
        let Some(end) = self.text.find('>') else { return Ok(None) };
        let rest = self.text.split_off(end + 1);
        let message = std::mem::replace(&mut self.text, rest);
        Ok(Some(message.trim_matches(['<', '>', ' ', '\n']).to_owned()))
    }
}

/// Parses `frame ID TIME BYTES`.
fn parse(message: &str) -> Option<Frame> {
    let mut words = message.split_ascii_whitespace();
    let ("frame", id, _) = (words.next()?, words.next()?, words.next()?) else { return None };
    let digits: String = words.collect();
    let byte = |at: usize| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok();
    let bytes: Option<Vec<u8>> = (0..digits.len()).step_by(2).map(byte).collect();
    Frame::new(u16::from_str_radix(id, 16).ok().filter(|_| id.len() <= 3)?, &bytes?)
}

impl Transmit for Bus {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        let mut text = format!("< send {:X} {} ", frame.id(), frame.len());
        for byte in frame.data() {
            let _ = write!(text, "{byte:02X} ");
        }
        self.stream.write_all((text + ">").as_bytes()).map_err(|_| QueueFull)
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}
