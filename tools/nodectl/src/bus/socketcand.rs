//! The client of a socketcand daemon: frames as text between angle brackets over TCP.
//!
//! Follows doc/protocol.md of <https://github.com/linux-can/socketcand>, in raw mode: the daemon reports every frame.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};
use std::net::ToSocketAddrs;

use canopen::{Duration, Frame, Instant};
use wire::socketcand;

use super::stream::Stream;
use super::{Bus, BusError, Controller, Received, clock};

/// How long the daemon may take to answer.
const ANSWER: Duration = Duration::from_millis(3000);
/// Without a bracket in this number of bytes, the peer does not speak the protocol.
const LONGEST: usize = 4096;

/// A message of the daemon.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Message {
    Hi,
    Ok,
    Error(String),
    /// An error frame, with its class.
    ErrorFrame(u32),
    Frame(Received),
    /// Messages that this client does not use: 29-bit identifiers, statistics.
    Other,
}

/// Reads one message without its brackets.
fn parse(text: &str) -> Message {
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    match words.as_slice() {
        ["hi"] => Message::Hi,
        ["ok"] => Message::Ok,
        ["error", class, at] if clock::parse(at).is_some() => {
            u32::from_str_radix(class, 16).map_or(Message::Other, Message::ErrorFrame)
        }
        ["error", reason @ ..] => Message::Error(reason.join(" ")),
        words => match socketcand::reported(words) {
            Some((frame, micros)) => Message::Frame(Received { frame, at: Instant(micros) }),
            None => Message::Other,
        },
    }
}

/// Cuts a stream of bytes into messages.
#[derive(Default)]
struct Splitter(Vec<u8>);

impl Splitter {
    /// Takes bytes; complete messages go to `messages`.
    fn push(&mut self, bytes: &[u8], messages: &mut VecDeque<Message>) {
        for &byte in bytes {
            match byte {
                b'<' => self.0.clear(),
                b'>' => messages.push_back(parse(&String::from_utf8_lossy(&std::mem::take(&mut self.0)))),
                _ if self.0.len() < LONGEST => self.0.push(byte),
                _ => (),
            }
        }
    }
}

/// A connection in raw mode.
pub(super) struct Socketcand {
    stream: Stream,
    splitter: Splitter,
    messages: VecDeque<Message>,
    controller: Controller,
}

impl Socketcand {
    /// Connects to a daemon and opens one of its buses.
    pub(super) fn connect(host: impl ToSocketAddrs, bus: &str) -> io::Result<Socketcand> {
        let stream = Stream::connect(host)?;
        let mut this = Socketcand {
            stream,
            splitter: Splitter::default(),
            messages: VecDeque::new(),
            controller: Controller::default(),
        };
        this.expect(&Message::Hi)?;
        for command in [format!("< open {bus} >"), "< rawmode >".to_owned()] {
            this.stream.write(&command).map_err(io::Error::other)?;
            this.expect(&Message::Ok)?;
        }
        Ok(this)
    }

    fn expect(&mut self, wanted: &Message) -> io::Result<()> {
        let until = self.now() + ANSWER;
        while let Some(message) = self.message(until).map_err(io::Error::other)? {
            match message {
                Message::Error(reason) => return Err(io::Error::other(reason)),
                message if message == *wanted => return Ok(()),
                _ => (),
            }
        }
        Err(io::Error::new(ErrorKind::TimedOut, "no socketcand answers there"))
    }

    fn message(&mut self, until: Instant) -> Result<Option<Message>, BusError> {
        loop {
            if let Some(message) = self.messages.pop_front() {
                return Ok(Some(message));
            }
            let bytes = self.stream.read(until)?;
            self.splitter.push(&bytes, &mut self.messages);
            if bytes.is_empty() && self.now() >= until {
                return Ok(None);
            }
        }
    }
}

impl Bus for Socketcand {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.stream.write(&socketcand::send(frame))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        while let Some(message) = self.message(until)? {
            match message {
                Message::Frame(received) => return Ok(Some(received)),
                Message::Error(reason) => return Err(BusError::Lost(io::Error::other(reason))),
                Message::ErrorFrame(class) => self.controller.on_error_frame(class, &[]),
                _ => (),
            }
        }
        Ok(None)
    }

    fn controller(&mut self) -> Controller {
        self.controller
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn messages(pieces: &[&str]) -> Vec<Message> {
        let (mut splitter, mut out) = (Splitter::default(), VecDeque::new());
        for piece in pieces {
            splitter.push(piece.as_bytes(), &mut out);
        }
        out.into()
    }

    fn received(id: u16, bytes: &[u8], at: u64) -> Message {
        Message::Frame(Received { frame: Frame::new(id, bytes).unwrap(), at: Instant(at) })
    }

    #[test]
    fn frames_however_they_are_cut() {
        let text =
            "< hi >< ok >< frame 123 1.000002 DEADBEEF >< frame 080 12.500000  >< frame 701 0.000001 05 06 >";
        let expected = [
            Message::Hi,
            Message::Ok,
            received(0x123, &[0xDE, 0xAD, 0xBE, 0xEF], 1_000_002),
            received(0x080, &[], 12_500_000),
            received(0x701, &[5, 6], 1),
        ];
        assert_eq!(messages(&[text]), expected);
        let letters: Vec<String> = text.chars().map(String::from).collect();
        assert_eq!(messages(&letters.iter().map(String::as_str).collect::<Vec<_>>()), expected);
        let remote = Received { frame: Frame::remote(0x701, 1).unwrap(), at: Instant(1) };
        assert_eq!(messages(&["< rtr 701 0.000001 1 >"]), [Message::Frame(remote)]);
    }

    #[test]
    fn frames_other_than_base_frames_are_ignored() {
        for text in [
            "< frame 00000123 1.0 01 >",
            "< frame 800 1.0 01 >",
            "< frame 123 1.0 010203040506070809 >",
            "< frame 123 1.0 0 >",
            "< frame 123 now 01 >",
            "< frame 123 1.0 +1 >",
            "< rtr 123 1.0 9 >",
            "< stat 1 2 3 4 >",
            "< >",
        ] {
            assert_eq!(messages(&[text]), [Message::Other], "{text}");
        }
        assert_eq!(messages(&["< error no such bus >"]), [Message::Error("no such bus".into())]);
    }

    #[test]
    fn noise_is_bounded_and_ends_with_the_next_bracket() {
        let noise = "x".repeat(10 * LONGEST);
        assert_eq!(messages(&[&noise, "< ok >"]), [Message::Ok]);
    }

    #[test]
    fn frames_to_send() {
        assert_eq!(
            socketcand::send(&Frame::new(0x601, &[0x40, 0, 0x10]).unwrap()),
            "< send 601 3 40 00 10 >"
        );
        assert_eq!(socketcand::send(&Frame::new(0x80, &[]).unwrap()), "< send 080 0 >");
        assert_eq!(socketcand::send(&Frame::remote(0x701, 1).unwrap()), "< sendrtr 701 1 >");
    }
}
