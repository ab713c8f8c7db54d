//! slcan: the line protocol of the LAWICEL CAN232 and CANUSB adapters ("CANUSB Manual", version 1.0, chapter 3).
//! python-can, slcand and many other tools use it.
//!
//! A command ends with a carriage return. Success is answered with a carriage return, refusal with a bell.

use canbus::{Frame, Id, Time};
use wire::slcan;

use super::session::{Action, Session};
use crate::port::Adapter;

const OK: &str = "\r";
const BELL: &str = "\x07";

/// Maximum length of a line; the longest valid line has 26 bytes.
const MAX_LINE: usize = 64;

/// One command of the protocol.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    /// `S0` to `S8`: the bit rate, in bit/s.
    BitRate(u32),
    /// `O`: go on the bus.
    Open,
    /// `L`: go on the bus in listen-only mode.
    Listen,
    /// `C`: leave the bus.
    Close,
    /// `t`, `T`, `r`, `R`: send a frame.
    Send(Frame),
    /// `V`: version of hardware and software.
    Version,
    /// `N`: serial number.
    SerialNumber,
    /// `F`: status flags.
    Flags,
    /// `Z0`, `Z1`: time stamps with received frames.
    TimeStamps(bool),
}

/// Parses one line without its carriage return; `None` when the line is not a command of the protocol.
pub(super) fn parse(line: &str) -> Option<Command> {
    let (name, rest) = line.split_at_checked(1)?;
    match (name, rest) {
        ("S", digit) => slcan::bit_rate(digit).map(|kbit| Command::BitRate(u32::from(kbit) * 1000)),
        ("O", "") => Some(Command::Open),
        ("L", "") => Some(Command::Listen),
        ("C", "") => Some(Command::Close),
        ("V", "") => Some(Command::Version),
        ("N", "") => Some(Command::SerialNumber),
        ("F", "") => Some(Command::Flags),
        ("Z", "0") => Some(Command::TimeStamps(false)),
        ("Z", "1") => Some(Command::TimeStamps(true)),
        // Behind the frame of a command nothing follows.
        _ => slcan::frame(line).filter(|(_, rest)| rest.is_empty()).map(|(frame, _)| Command::Send(frame)),
    }
}

/// A received frame as a line. The time stamp counts milliseconds and starts again every minute (manual, `Zn`).
fn format_frame(frame: &Frame, at: Time, stamped: bool) -> String {
    let mut line = slcan::line(frame);
    if stamped {
        line += &format!("{:04X}", at.as_micros() / 1000 % 60_000);
    }
    line.push('\r');
    line
}

/// The session of one client.
#[derive(Debug)]
pub(super) struct Slcan {
    bit_rate: u32,
    open: Option<Adapter>,
    stamped: bool,
    line: Vec<u8>,
    /// The client has sent a whole line.
    has_spoken: bool,
}

impl Slcan {
    /// A session whose adapter runs at `bit_rate` (bit/s) until the client chooses another rate.
    pub(super) fn new(bit_rate: u32) -> Slcan {
        Slcan { bit_rate, open: None, stamped: false, line: Vec::new(), has_spoken: false }
    }

    fn on_line(&mut self, line: &[u8], out: &mut Vec<Action>) {
        let command = std::str::from_utf8(line).ok().and_then(parse);
        if command.and_then(|command| self.serve(command, out)).is_none() {
            out.push(Action::stream(BELL));
        }
    }

    /// Carries out a command; `None` is a refusal. The manual states for each command whether it is allowed while the
    /// channel is open.
    fn serve(&mut self, command: Command, out: &mut Vec<Action>) -> Option<()> {
        let mut reply = OK.to_owned();
        match (command, self.open) {
            (Command::BitRate(rate), None) => self.bit_rate = rate,
            (Command::TimeStamps(on), None) => self.stamped = on,
            (Command::Open, None) => self.attach(false, out),
            (Command::Listen, None) => self.attach(true, out),
            (Command::Close, _) => {
                self.open = None;
                out.push(Action::Detach);
            }
            (Command::Send(frame), Some(Adapter { silent: false, .. })) => {
                out.push(Action::Send(frame));
                reply.insert(0, if matches!(frame.id(), Id::Standard(_)) { 'z' } else { 'Z' });
            }
            (Command::Flags, Some(_)) => reply.insert_str(0, "F00"),
            (Command::Version, _) => reply.insert_str(0, "V0101"),
            (Command::SerialNumber, _) => reply.insert_str(0, "NSIM0"),
            _ => return None,
        }
        out.push(Action::Stream(reply));
        Some(())
    }

    fn attach(&mut self, silent: bool, out: &mut Vec<Action>) {
        let adapter = Adapter { bit_rate: self.bit_rate, silent };
        self.open = Some(adapter);
        out.push(Action::Attach(adapter));
    }
}

impl Session for Slcan {
    fn greet(&mut self, _: &mut Vec<Action>) {}

    fn on_bytes(&mut self, bytes: &[u8], out: &mut Vec<Action>) {
        for &byte in bytes {
            match byte {
                // Clients send empty lines to clear the adapter's buffer; an empty line gets no answer.
                b'\r' | b'\n' if self.line.is_empty() => {}
                b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    self.has_spoken = true;
                    self.on_line(&line, out);
                }
                // Lines of the protocol have letters and digits only.
                _ if !self.has_spoken && !byte.is_ascii_alphanumeric() => return out.push(Action::Close),
                _ if self.line.len() < MAX_LINE => self.line.push(byte),
                // The line is too long; it is refused at its end.
                _ => {}
            }
        }
    }

    fn on_frame(&mut self, frame: &Frame, at: Time) -> Option<String> {
        self.open.map(|_| format_frame(frame, at, self.stamped))
    }
}

#[cfg(test)]
mod tests {
    use canbus::{ExtendedId, StandardId};
    use proptest::prelude::*;

    use super::*;

    fn talk(session: &mut Slcan, text: &str) -> Vec<Action> {
        let mut out = Vec::new();
        session.on_bytes(text.as_bytes(), &mut out);
        out
    }

    fn ok() -> Action {
        Action::stream("\r")
    }

    fn open() -> Slcan {
        let mut session = Slcan::new(250_000);
        talk(&mut session, "O\r");
        session
    }

    #[test]
    fn python_can_opens_with_a_bit_rate() {
        let mut session = Slcan::new(250_000);
        let attach = Action::Attach(Adapter { bit_rate: 1_000_000, silent: false });
        assert_eq!(talk(&mut session, "C\rS8\r\rO\r"), [Action::Detach, ok(), ok(), attach, ok()]);
    }

    #[test]
    fn frames_of_every_kind_are_sent() {
        let standard = StandardId::new(0x123).unwrap();
        let extended = ExtendedId::new(0x1234_5678).unwrap();
        let sent = |text, frame: Option<Frame>, reply| {
            assert_eq!(talk(&mut open(), text), [Action::Send(frame.unwrap()), Action::stream(reply)]);
        };
        sent("t1232ABcd\r", Frame::data(standard, &[0xAB, 0xCD]), "z\r");
        sent("T123456780\r", Frame::data(extended, &[]), "Z\r");
        sent("r1238\r", Frame::remote(standard, 8), "z\r");
        sent("R123456781\r", Frame::remote(extended, 1), "Z\r");
    }

    #[test]
    fn received_frames_with_and_without_time_stamps() {
        let frame = Frame::data(StandardId::new(0x81).unwrap(), &[1, 0xFE]).unwrap();
        let at = Time::from_millis(60_000 + 0x1234);
        assert_eq!(open().on_frame(&frame, at).as_deref(), Some("t081201FE\r"));
        let mut stamped = Slcan::new(250_000);
        talk(&mut stamped, "Z1\rL\r");
        assert_eq!(stamped.on_frame(&frame, at).as_deref(), Some("t081201FE1234\r"));
        talk(&mut stamped, "C\r");
        assert_eq!(stamped.on_frame(&frame, at), None);
    }

    #[test]
    fn a_client_of_another_protocol_is_disconnected() {
        for first in ["GET / HTTP/1.1\r\n", "OPTIONS *", "t1230 ", "\u{16}\u{3}\u{1}", "<"] {
            let text = format!("{first}\rO\rt00020200\r");
            assert_eq!(talk(&mut Slcan::new(250_000), &text), [Action::Close], "{text:?}");
        }
        let mut session = Slcan::new(250_000);
        assert_eq!(talk(&mut session, "\r\n\rQ1\r"), [Action::stream("\x07")], "a command that is not known");
        assert_eq!(talk(&mut session, "GET /\r"), [Action::stream("\x07")]);
    }

    #[test]
    fn commands_in_a_wrong_channel_state_are_refused() {
        for text in ["t1230\r", "F\r"] {
            assert_eq!(talk(&mut Slcan::new(250_000), text), [Action::stream("\x07")], "{text:?}");
        }
        for text in [
            "S4\r", "O\r", "L\r", "Z1\r", "t123\r", "t1231\r", "t12310\r", "t1239\r", "S9\r", "t8000\r",
            "q\r",
        ] {
            assert_eq!(talk(&mut open(), text), [Action::stream("\x07")], "{text:?}");
        }
        let mut listening = Slcan::new(250_000);
        talk(&mut listening, "L\r");
        assert_eq!(talk(&mut listening, "t1230\r"), [Action::stream("\x07")]);
    }

    #[test]
    fn identification() {
        assert_eq!(
            talk(&mut Slcan::new(1), "V\rN\r"),
            [Action::stream("V0101\r"), Action::stream("NSIM0\r")]
        );
        assert_eq!(talk(&mut open(), "F\r"), [Action::stream("F00\r")]);
    }

    proptest! {
        /// Every line gets exactly one answer to the client, whatever its bytes.
        #[test]
        fn every_line_is_answered_once(line in prop::collection::vec(any::<u8>(), 1..100)) {
            prop_assume!(!line.contains(&b'\r') && line[0] != b'\n');
            let mut out = Vec::new();
            let mut session = open();
            session.on_bytes(&line, &mut out);
            prop_assert!(out.is_empty());
            session.on_bytes(b"\r", &mut out);
            let answers = out.iter().filter(|action| matches!(action, Action::Stream(_))).count();
            prop_assert_eq!(answers, 1);
        }

        /// The text that one client sends arrives unchanged at another client.
        #[test]
        fn a_frame_goes_through_unchanged(id in 0u32..0x2000_0000, extended: bool, remote: bool, bytes in prop::collection::vec(any::<u8>(), 0..=8)) {
            let id: Id = if extended { ExtendedId::new(id).unwrap().into() } else { StandardId::new(id as u16 & 0x7FF).unwrap().into() };
            let frame = if remote { Frame::remote(id, bytes.len() as u8) } else { Frame::data(id, &bytes) }.unwrap();
            let line = format_frame(&frame, Time::ZERO, false);
            prop_assert_eq!(parse(line.trim_end()), Some(Command::Send(frame)));
        }
    }
}
