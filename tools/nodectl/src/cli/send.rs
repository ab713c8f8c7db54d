//! `nodectl send`: sends frames that no service of this tool makes, for example a SYNC.

use std::fmt;

use canopen::{Duration, Frame};
use clap::Args;
use serde::Serialize;

use super::{Failure, Session};
use crate::text::counted;
use crate::trace::{LogReader, Record};

/// Sends single frames: a SYNC (080#), an RPDO, an NMT command. The frames are in the form of candump and cansend.
#[derive(Debug, Args)]
pub(super) struct Send {
    /// CAN-ID in hexadecimal digits, "#" and up to eight bytes: 080#, 201#0102, 000#0105.
    #[arg(required = true, value_name = "ID#DATA", value_parser = frame)]
    frames: Vec<Frame>,

    /// How many times the frames are sent.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    count: u32,

    /// Milliseconds from one time to the next.
    #[arg(long, value_name = "MS", default_value_t = 100, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
}

#[derive(Serialize)]
struct Done {
    frames: usize,
}

impl Send {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let begin = session.network.now();
        let mut done = Done { frames: 0 };
        for time in 0..self.count {
            let due = begin + Duration::from_millis(u64::from(time) * u64::from(self.every));
            session.network.pause(Duration(due.0.saturating_sub(session.network.now().0)))?;
            for frame in &self.frames {
                session.network.send(frame)?;
                done.frames += 1;
            }
        }
        session.print(&done)
    }
}

impl fmt::Display for Done {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&counted(self.frames, "frame sent", "frames sent"))
    }
}

/// A data frame with an 11-bit identifier.
fn frame(text: &str) -> Result<Frame, String> {
    let is_plain = !text.contains(char::is_whitespace);
    match LogReader::default().line(&format!("- {text}")) {
        Ok(Some((_, Record::Frame(frame)))) if is_plain && text.contains('#') && !frame.is_remote() => {
            Ok(frame)
        }
        _ => Err(format!("\"{text}\" is no data frame with an 11-bit identifier, such as 201#0102 or 080#")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_have_the_form_of_cansend() {
        for (text, id, data) in [
            ("080#", 0x080, &[][..]),
            ("201#0102", 0x201, &[1, 2]),
            ("000#0105", 0, &[1, 5]),
            ("7ff#FF", 0x7FF, &[0xFF]),
        ] {
            let frame = frame(text).unwrap();
            assert_eq!((frame.id(), frame.data()), (id, data), "{text}");
        }
    }

    #[test]
    fn other_texts_and_other_frames_are_rejected() {
        for text in [
            "",
            "080",
            "#",
            "#01",
            "800#",
            "80#0",
            "201#010203040506070809",
            "18EBFF00#01",
            "123##100",
            "701#R",
            "201# 01",
            "# x",
        ] {
            assert!(frame(text).is_err(), "{text}");
        }
    }
}
