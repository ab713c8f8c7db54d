//! The socketcand protocol: frames as text between angle brackets over TCP.
//!
//! Follows doc/protocol.md and socketcandcl.c of <https://github.com/linux-can/socketcand>: raw mode, and the part
//! of the broadcast-manager mode that needs no timers. Error frames are not reported.

use std::collections::BTreeSet;

use canbus::{Frame, Id, Time};
use wire::socketcand::{self, Bytes};

use super::session::{Action, Session};
use crate::port::Adapter;

/// Maximum length of a message; the longest valid message has 47 bytes.
const MAX_MESSAGE: usize = 200;

/// A request of a client.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Request {
    /// `< open vcan0 >`
    Open(String),
    /// `< rawmode >`: every frame of the bus is reported.
    RawMode,
    /// `< bcmmode >`: subscribed identifiers are reported.
    BcmMode,
    /// `< echo >`: answered with the same message.
    Echo,
    /// `< send ID DLC BYTES >`, `< sendrtr ID DLC >`
    Send(Frame),
    /// `< subscribe SECONDS MICROSECONDS ID >`
    Subscribe(Id),
    /// `< unsubscribe ID >`
    Unsubscribe(Id),
}

/// The reason for a refusal; its text goes to the client in `< error .. >`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Refused {
    /// Not `< word ... >`.
    #[error("not a message")]
    NotAMessage,
    /// The word is not part of the protocol, or not supported by this server.
    #[error("unknown command")]
    UnknownCommand,
    /// The word is known, but its arguments are invalid.
    #[error("bad arguments")]
    BadArguments,
    /// No bus has this name.
    #[error("no such bus")]
    NoSuchBus,
    /// Only `open` and `echo` are possible before a bus is open.
    #[error("no bus is open")]
    NotOpen,
}

/// Parses one message without its brackets.
pub(super) fn parse(text: &str) -> Result<Request, Refused> {
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let (command, arguments) = words.split_first().ok_or(Refused::NotAMessage)?;
    let bad = Refused::BadArguments;
    match (*command, arguments) {
        ("open", [bus]) => Ok(Request::Open((*bus).to_owned())),
        ("rawmode", []) => Ok(Request::RawMode),
        ("bcmmode", []) => Ok(Request::BcmMode),
        ("echo", []) => Ok(Request::Echo),
        ("send" | "sendrtr", _) => socketcand::sent(&words).map(Request::Send).ok_or(bad),
        // An interval other than zero requests throttling, which only the kernel's broadcast manager offers.
        ("subscribe", ["0", "0", id]) => socketcand::id(id).map(Request::Subscribe).ok_or(bad),
        ("unsubscribe", [id]) => socketcand::id(id).map(Request::Unsubscribe).ok_or(bad),
        ("open" | "rawmode" | "bcmmode" | "echo" | "subscribe" | "unsubscribe", _) => Err(bad),
        _ => Err(Refused::UnknownCommand),
    }
}

/// The frames of the bus that are reported to the client.
#[derive(Debug)]
enum Mode {
    Closed,
    /// The mode after `open`.
    Broadcast(BTreeSet<u32>),
    Raw,
}

/// The session of one client.
#[derive(Debug)]
pub(super) struct Socketcand {
    bus: &'static str,
    bit_rate: u32,
    mode: Mode,
    input: Vec<u8>,
    /// The client has begun a message.
    has_spoken: bool,
}

impl Socketcand {
    /// A session on the bus with this name and bit rate (bit/s).
    pub(super) fn new(bus: &'static str, bit_rate: u32) -> Socketcand {
        Socketcand { bus, bit_rate, mode: Mode::Closed, input: Vec::new(), has_spoken: false }
    }

    /// Acts on a message with its brackets, or on other bytes before a message.
    fn on_message(&mut self, bytes: &[u8], out: &mut Vec<Action>) {
        let text = std::str::from_utf8(bytes).ok();
        let inner = text.and_then(|text| text.trim_ascii().strip_prefix('<')?.strip_suffix('>'));
        let request = inner.ok_or(Refused::NotAMessage).and_then(parse);
        if let Err(refused) = request.and_then(|request| self.serve(request, out)) {
            out.push(Action::segment(format!("< error {refused} >")));
        }
    }

    fn serve(&mut self, request: Request, out: &mut Vec<Action>) -> Result<(), Refused> {
        match (request, &mut self.mode) {
            (Request::Echo, _) => out.push(Action::segment("< echo >")),
            (Request::Open(bus), _) if bus == self.bus => self.open(out),
            (Request::Open(_), _) => return Err(Refused::NoSuchBus),
            (_, Mode::Closed) => return Err(Refused::NotOpen),
            (Request::RawMode, mode) => change(mode, Mode::Raw, out),
            (Request::BcmMode, mode) => change(mode, Mode::Broadcast(BTreeSet::new()), out),
            (Request::Send(frame), _) => out.push(Action::Send(frame)),
            (Request::Subscribe(id), Mode::Broadcast(ids)) => drop(ids.insert(key(id))),
            (Request::Unsubscribe(id), Mode::Broadcast(ids)) => drop(ids.remove(&key(id))),
            (Request::Subscribe(_) | Request::Unsubscribe(_), Mode::Raw) => {
                return Err(Refused::UnknownCommand);
            }
        }
        Ok(())
    }

    fn open(&mut self, out: &mut Vec<Action>) {
        out.push(Action::Attach(Adapter { bit_rate: self.bit_rate, silent: false }));
        change(&mut self.mode, Mode::Broadcast(BTreeSet::new()), out);
    }
}

fn change(mode: &mut Mode, to: Mode, out: &mut Vec<Action>) {
    *mode = to;
    out.push(Action::segment("< ok >"));
}

/// Standard and extended identifiers as one number.
fn key(id: Id) -> u32 {
    match id {
        Id::Standard(id) => u32::from(id.as_raw()),
        Id::Extended(id) => id.as_raw() | 1 << 31,
    }
}

impl Session for Socketcand {
    fn greet(&mut self, out: &mut Vec<Action>) {
        out.push(Action::segment("< hi >"));
    }

    fn on_bytes(&mut self, bytes: &[u8], out: &mut Vec<Action>) {
        for &byte in bytes {
            // Some clients end a message with a line feed or a zero (Flash sockets did).
            if self.input.is_empty() && (byte.is_ascii_whitespace() || byte == 0) {
                continue;
            }
            self.has_spoken |= byte == b'<';
            if !self.has_spoken {
                return out.push(Action::Close);
            }
            self.input.push(byte);
            if byte == b'>' || self.input.len() > MAX_MESSAGE {
                let message = std::mem::take(&mut self.input);
                self.on_message(&message, out);
            }
        }
    }

    fn on_frame(&mut self, frame: &Frame, at: Time) -> Option<String> {
        match &self.mode {
            Mode::Raw => Some(socketcand::report(frame, at.as_micros(), Bytes::Together)),
            Mode::Broadcast(ids) if ids.contains(&key(frame.id())) => {
                Some(socketcand::report(frame, at.as_micros(), Bytes::Apart))
            }
            Mode::Broadcast(_) | Mode::Closed => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use canbus::{ExtendedId, StandardId};
    use proptest::prelude::*;

    use super::*;

    fn standard(id: u16, bytes: &[u8]) -> Frame {
        Frame::data(StandardId::new(id).unwrap(), bytes).unwrap()
    }

    /// The actions that result when a client sends `text`.
    fn talk(session: &mut Socketcand, text: &str) -> Vec<Action> {
        let mut out = Vec::new();
        session.on_bytes(text.as_bytes(), &mut out);
        out
    }

    fn raw() -> Socketcand {
        let mut session = Socketcand::new("vcan0", 250_000);
        talk(&mut session, "< open vcan0 >< rawmode >");
        session
    }

    #[test]
    fn the_handshake_of_python_can() {
        let mut session = Socketcand::new("vcan0", 250_000);
        let mut out = Vec::new();
        session.greet(&mut out);
        assert_eq!(out, [Action::segment("< hi >")]);
        let attach = Action::Attach(Adapter { bit_rate: 250_000, silent: false });
        assert_eq!(talk(&mut session, "< open vcan0 >"), [attach, Action::segment("< ok >")]);
        assert_eq!(talk(&mut session, "< rawmode >"), [Action::segment("< ok >")]);
        assert_eq!(
            talk(&mut session, "< send 601 8 40 0 10 0 0 0 0 0 >"),
            [Action::Send(standard(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]))]
        );
    }

    #[test]
    fn frames_as_python_can_reads_them() {
        let at = Time::from_micros(1_000_000);
        let mut session = raw();
        let text = session.on_frame(&standard(0x123, &[0xDE, 0xAD, 0xBE, 0xEF]), at);
        assert_eq!(text.as_deref(), Some("< frame 123 1.000000 DEADBEEF >"));
        let text = session.on_frame(&standard(0x80, &[]), at);
        assert_eq!(text.as_deref(), Some("< frame 080 1.000000  >"));
        let extended = Frame::data(ExtendedId::new(0x123).unwrap(), &[1]).unwrap();
        assert_eq!(session.on_frame(&extended, at).as_deref(), Some("< frame 00000123 1.000000 01 >"));
        let remote = Frame::remote(StandardId::new(0x701).unwrap(), 1).unwrap();
        assert_eq!(session.on_frame(&remote, at).as_deref(), Some("< rtr 701 1.000000 1 >"));
        assert_eq!(talk(&mut session, "< sendrtr 701 1 >"), [Action::Send(remote)]);
    }

    #[test]
    fn refused_commands_have_their_answers() {
        let mut session = Socketcand::new("vcan0", 250_000);
        let mut refused = |text, why| {
            assert_eq!(talk(&mut session, text), [Action::segment(format!("< error {why} >"))], "{text}");
        };
        refused("< rawmode >", "no bus is open");
        refused("< open can7 >", "no such bus");
        refused("< open >", "bad arguments");
        refused("< fly >", "unknown command");
        refused("< >", "not a message");
        refused("hello >", "not a message");
        let mut session = raw();
        let bad = [
            "< send 123 8  >",
            "< send 800 0 >",
            "< send 1234 0 >",
            "< send 123 1 100 >",
            "< send 1 1 +1 >",
            "< sendrtr 1 9 >",
        ];
        for text in bad {
            assert_eq!(talk(&mut session, text), [Action::segment("< error bad arguments >")], "{text}");
        }
    }

    #[test]
    fn a_client_of_another_protocol_is_disconnected() {
        for first in ["GET / HTTP/1.1\r\n", "POST", "x", "\u{16}\u{3}\u{1}", ">< open vcan0 >"] {
            let text = format!("{first}< open vcan0 >< send 000 2 2 0 >");
            assert_eq!(talk(&mut Socketcand::new("vcan0", 250_000), &text), [Action::Close], "{text:?}");
        }
        let mut session = Socketcand::new("vcan0", 250_000);
        assert!(!talk(&mut session, "\n\0 < open vcan0 >").contains(&Action::Close));
        assert_eq!(talk(&mut session, "GET >"), [Action::segment("< error not a message >")]);
    }

    #[test]
    fn broadcast_mode_reports_subscribed_frames() {
        let mut session = Socketcand::new("vcan0", 250_000);
        talk(&mut session, "< open vcan0 >< subscribe 0 0 701 >");
        let heartbeat = standard(0x701, &[5, 6]);
        let text = session.on_frame(&heartbeat, Time::ZERO);
        assert_eq!(text.as_deref(), Some("< frame 701 0.000000 05 06 >"));
        assert_eq!(session.on_frame(&standard(0x702, &[5]), Time::ZERO), None);
        talk(&mut session, "< unsubscribe 701 >");
        assert_eq!(session.on_frame(&heartbeat, Time::ZERO), None);
    }

    proptest! {
        /// Any bytes, in any segments, give the same answers, and at most one answer for each message.
        #[test]
        fn any_bytes_are_served_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..600), cut in 0usize..600) {
            let (mut whole, mut halves) = (raw(), raw());
            let (mut one, mut two) = (Vec::new(), Vec::new());
            whole.on_bytes(&bytes, &mut one);
            let (head, tail) = bytes.split_at(cut.min(bytes.len()));
            halves.on_bytes(head, &mut two);
            halves.on_bytes(tail, &mut two);
            prop_assert_eq!(&one, &two);
            prop_assert!(whole.input.len() <= MAX_MESSAGE);
        }

        /// The bus carries the frame that the client sends.
        #[test]
        fn every_frame_can_be_sent(id in 0u32..0x2000_0000, extended: bool, bytes in prop::collection::vec(any::<u8>(), 0..=8)) {
            let id = if extended { Id::Extended(ExtendedId::new(id).unwrap()) } else { Id::Standard(StandardId::new(id as u16 & 0x7FF).unwrap()) };
            let number = match id { Id::Standard(id) => format!("{:03X}", id.as_raw()), Id::Extended(id) => format!("{:08X}", id.as_raw()) };
            let data: Vec<String> = bytes.iter().map(|byte| format!("{byte:x}")).collect();
            let text = format!("< send {number} {:X} {} >", bytes.len(), data.join(" "));
            prop_assert_eq!(talk(&mut raw(), &text), [Action::Send(Frame::data(id, &bytes).unwrap())]);
        }

        /// Every invalid message is answered with exactly one `< error .. >`.
        #[test]
        fn every_message_is_answered(text in "[ -;=?-~]{0,80}") {
            let out = talk(&mut raw(), &format!("<{text}>"));
            match parse(&text) {
                Err(why) => prop_assert_eq!(out, [Action::segment(format!("< error {why} >"))]),
                Ok(_) => prop_assert!(out.len() <= 2),
            }
        }
    }
}
