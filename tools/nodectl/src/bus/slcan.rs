//! slcan: the line protocol of the LAWICEL CAN232 and CANUSB adapters ("CANUSB Manual", version 1.0, chapter 3).
//!
//! A command ends with a carriage return. An adapter answers with a carriage return for success and with a bell for
//! refusal. Some adapters do not answer every command, so nothing waits for an answer.

use std::collections::VecDeque;
use std::io::{self, ErrorKind};

use canopen::{Duration, Frame, Instant};
use wire::slcan::{self, BIT_RATES};

use super::stream::Stream;
use super::{Bus, BusError, Controller, Received, clock};

/// How long to wait for the greeting of a peer that is no adapter.
const GREETING: Duration = Duration::from_millis(200);
/// The bits of the longest frame with an 11-bit identifier, with all possible stuff bits and the interframe space.
const FRAME_BITS: u64 = 135;
/// How long other participants of the bus may hold up the last frames.
const MARGIN: Duration = Duration::from_millis(50);
/// The longest line of an adapter is an extended frame with a time stamp: 30 characters.
const LONGEST: usize = 64;

/// The line that sends a frame.
fn format(frame: &Frame) -> String {
    slcan::line(frame) + "\r"
}

/// The commands that leave the bus if the adapter is on it, set the bit rate and go on the bus. The empty lines end an
/// unfinished command of an earlier user.
fn opening(bit_rate: u16) -> io::Result<String> {
    let index = BIT_RATES.iter().position(|&rate| rate == bit_rate);
    let index = index.ok_or_else(|| {
        let message = format!("slcan has these bit rates in kbit/s: {BIT_RATES:?}");
        io::Error::new(ErrorKind::InvalidInput, message)
    })?;
    Ok(format!("\r\rC\rS{index}\rO\r"))
}

/// Cuts a stream of bytes into frames and status flags. Other lines are ignored.
#[derive(Default)]
struct Splitter {
    line: Vec<u8>,
    controller: Controller,
}

impl Splitter {
    fn push(&mut self, bytes: &[u8], frames: &mut VecDeque<Frame>) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\x07' => {
                    let line = std::mem::take(&mut self.line);
                    let line = String::from_utf8_lossy(&line);
                    if let Some(flags) = flags(&line) {
                        self.controller.on_flags(flags);
                    }
                    // A time stamp may follow the frame.
                    frames.extend(slcan::frame::<Frame>(&line).map(|(frame, _)| frame));
                }
                // Some adapters acknowledge a sent frame without a carriage return.
                b'z' | b'Z' if self.line.is_empty() => (),
                _ if self.line.len() < LONGEST => self.line.push(byte),
                _ => (),
            }
        }
    }
}

/// The status flags in the answer to the command `F`: `F00`.
fn flags(line: &str) -> Option<u8> {
    line.strip_prefix('F')
        .filter(|digits| digits.len() == 2)
        .and_then(|digits| u8::from_str_radix(digits, 16).ok())
}

/// An adapter that is on the bus.
pub(super) struct Slcan {
    stream: Stream,
    splitter: Splitter,
    frames: VecDeque<Frame>,
    /// The time of one frame on the bus.
    frame_time: Duration,
    /// The latest time at which the bus has carried all frames, if no other node sends.
    sent_at: Instant,
}

impl Slcan {
    pub(super) fn connect(host: &str, bit_rate: u16) -> io::Result<Slcan> {
        let mut stream = Stream::connect(host)?;
        // A socketcand daemon greets at once; an adapter sends nothing before a command.
        let greeting = stream.read(clock::now() + GREETING).map_err(io::Error::other)?;
        if greeting.starts_with(b"<") {
            let message = "a socketcand answers there: the address is socketcand://HOST:PORT/BUS";
            return Err(io::Error::new(ErrorKind::InvalidData, message));
        }
        Slcan::open(stream, bit_rate)
    }

    pub(super) fn open_serial(device: &str, bit_rate: u16) -> io::Result<Slcan> {
        Slcan::open(Stream::serial(device)?, bit_rate)
    }

    fn open(mut stream: Stream, bit_rate: u16) -> io::Result<Slcan> {
        stream.write(&opening(bit_rate)?).map_err(io::Error::other)?;
        let frame_time = Duration(FRAME_BITS * 1000 / u64::from(bit_rate));
        let (splitter, frames) = (Splitter::default(), VecDeque::new());
        Ok(Slcan { stream, splitter, frames, frame_time, sent_at: Instant(0) })
    }
}

impl Drop for Slcan {
    /// Closes the adapter. An open adapter would fill its buffer for the next user. An adapter drops the frames that it
    /// has not sent when it is closed, and does not tell when it has sent them. So the frames get the time that they
    /// take on the bus.
    fn drop(&mut self) {
        if self.sent_at > Instant(0) {
            std::thread::sleep(clock::left(self.sent_at + MARGIN));
        }
        let _ = self.stream.write("C\r");
    }
}

impl Bus for Slcan {
    fn now(&self) -> Instant {
        clock::now()
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.sent_at = self.sent_at.max(self.now()) + self.frame_time;
        self.stream.write(&format(frame))
    }

    fn receive(&mut self, until: Instant) -> Result<Option<Received>, BusError> {
        loop {
            if let Some(frame) = self.frames.pop_front() {
                return Ok(Some(Received { frame, at: self.now() }));
            }
            let bytes = self.stream.read(until)?;
            self.splitter.push(&bytes, &mut self.frames);
            if bytes.is_empty() && self.now() >= until {
                return Ok(None);
            }
        }
    }

    /// The answer to the command `F` comes between the frames. Reading the flags clears them in the adapter.
    fn controller(&mut self) -> Controller {
        // A lost adapter is reported by the next read.
        let _ = self.stream.write("F\r");
        self.splitter.controller
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(text: &str) -> Vec<Frame> {
        let (mut splitter, mut out) = (Splitter::default(), VecDeque::new());
        splitter.push(text.as_bytes(), &mut out);
        out.into()
    }

    #[test]
    fn frames_between_answers() {
        let text = "\r\rz\rt0812FE01\rzt7010\r\x07r7011\rF00\rt081201FE1234\rZ\r";
        let expected = [
            Frame::new(0x81, &[0xFE, 1]).unwrap(),
            Frame::new(0x701, &[]).unwrap(),
            Frame::remote(0x701, 1).unwrap(),
            Frame::new(0x81, &[1, 0xFE]).unwrap(),
        ];
        assert_eq!(frames(text), expected);
    }

    #[test]
    fn frames_other_than_base_frames_are_ignored() {
        for text in ["T000001230\r", "t8000\r", "t1239\r", "t12311\r", "t123\r", "t1231+1\r", "\u{e9}t1230\r"]
        {
            assert_eq!(frames(text), [], "{text}");
        }
        let noise = "y".repeat(1000) + "\rt1230\r";
        assert_eq!(frames(&noise), [Frame::new(0x123, &[]).unwrap()]);
    }

    #[test]
    fn status_flags_between_frames() {
        let (mut splitter, mut out) = (Splitter::default(), VecDeque::new());
        splitter.push(b"t7010\rF8", &mut out);
        assert_eq!(splitter.controller, Controller::default());
        splitter.push(b"4\rt7010\rF\rF1G\r", &mut out);
        assert_eq!((out.len(), splitter.controller.error_frames), (2, Some(1)));
    }

    #[test]
    fn frames_to_send() {
        assert_eq!(format(&Frame::new(0x601, &[0x40, 0, 0x10]).unwrap()), "t6013400010\r");
        assert_eq!(format(&Frame::remote(0x701, 1).unwrap()), "r7011\r");
    }

    #[test]
    fn opening_sets_the_bit_rate() {
        assert_eq!(opening(250).unwrap(), "\r\rC\rS5\rO\r");
        assert_eq!(opening(1000).unwrap(), "\r\rC\rS8\rO\r");
        assert!(opening(300).unwrap_err().to_string().contains("250"));
    }
}
