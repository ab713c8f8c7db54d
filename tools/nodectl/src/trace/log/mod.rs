//! Logs of other programs: candump, Vector (.asc) and PEAK (.trc).

mod asc;
mod candump;
mod trc;

use canopen::{Frame, Instant};

/// A line that is no record of a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no record of candump, as (1.000000) can0 701#05 or can0 701 [1] 05, of Vector (.asc) or of PEAK (.trc)"
)]
pub struct NotARecord;

/// A record of a log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Record {
    /// A frame that CANopen may use.
    Frame(Frame),
    /// A frame that CANopen does not use.
    Foreign(Foreign),
}

/// A frame that CANopen does not use.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Foreign {
    /// Its kind.
    pub kind: ForeignKind,
    /// The identifier; 0 for an error frame.
    pub id: u32,
    /// The data.
    pub data: Vec<u8>,
}

/// A kind of frame that CANopen does not use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ForeignKind {
    /// A 29-bit identifier.
    Extended,
    /// CAN FD.
    Fd,
    /// An error frame of the controller.
    Error,
}

impl ForeignKind {
    /// The kind in words.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            ForeignKind::Extended => "29-bit identifier",
            ForeignKind::Fd => "CAN FD",
            ForeignKind::Error => "error frame",
        }
    }
}

/// The form of a log, which its first lines tell.
#[derive(Debug, Default)]
enum Form {
    #[default]
    Candump,
    Asc(asc::Head),
    Trc(trc::Head),
}

/// Reads the lines of a log, in their order.
#[derive(Debug, Default)]
pub struct LogReader {
    form: Form,
    /// The time of the record before, for logs with relative times.
    last: Instant,
    /// Whether the record before is an error frame, which candump explains in lines of their own.
    is_after_error: bool,
}

impl LogReader {
    /// The record of a line; `None` for a line of the head, a comment, an event or an empty line.
    ///
    /// # Errors
    /// The line is no record.
    pub fn line(&mut self, line: &str) -> Result<Option<(Instant, Record)>, NotARecord> {
        // Some editors begin a file with a byte order mark.
        let text = line.trim_start_matches('\u{FEFF}').trim();
        if text.is_empty() || (self.is_after_error && line.starts_with('\t')) || self.is_head(text) {
            return Ok(None);
        }
        let record = match &self.form {
            Form::Candump => candump::parse(text).map(Some),
            Form::Asc(head) => asc::parse(text, head, self.last),
            Form::Trc(head) => trc::parse(text, head),
        }?;
        if let Some((at, record)) = &record {
            self.last = *at;
            self.is_after_error = matches!(record, Record::Foreign(Foreign { kind: ForeignKind::Error, .. }));
        }
        Ok(record)
    }

    /// Whether a line is of the head, or a comment.
    fn is_head(&mut self, text: &str) -> bool {
        if let Some(line) = text.strip_prefix(';') {
            let mut head = if let Form::Trc(head) = &self.form { head.clone() } else { trc::Head::default() };
            head.line(line);
            self.form = Form::Trc(head);
            return true;
        }
        if let Some(head) = asc::Head::parse(text) {
            self.form = Form::Asc(head);
            return true;
        }
        text.starts_with('#') || text.starts_with("//") || text.to_ascii_lowercase().starts_with("date ")
    }
}

/// A frame of a record by its identifier: 11 bits are CANopen, more are not.
fn classic(id: u32, is_extended: bool, data: Vec<u8>) -> Result<Record, NotARecord> {
    match u16::try_from(id) {
        Ok(base) if !is_extended => Frame::new(base, &data).map(Record::Frame).ok_or(NotARecord),
        _ if id < 1 << 29 && data.len() <= 8 => {
            Ok(Record::Foreign(Foreign { kind: ForeignKind::Extended, id, data }))
        }
        _ => Err(NotARecord),
    }
}

/// A remote frame of a record.
fn remote(id: u32, is_extended: bool, length: u8) -> Result<Record, NotARecord> {
    match u16::try_from(id) {
        Ok(base) if !is_extended => Frame::remote(base, length).map(Record::Frame).ok_or(NotARecord),
        _ => classic(id, is_extended, Vec::new()),
    }
}

fn foreign(kind: ForeignKind, id: u32, data: Vec<u8>) -> Record {
    Record::Foreign(Foreign { kind, id, data })
}

/// A hexadecimal number without a sign.
fn hex(digits: &str) -> Result<u32, NotARecord> {
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| is_plain).ok_or(NotARecord)
}

/// The instant of a number of seconds or of milliseconds, as a decimal fraction.
fn instant(text: &str, micros: f64) -> Result<Instant, NotARecord> {
    let number: f64 = text.parse().map_err(|_| NotARecord)?;
    let micros = (number * micros).round();
    if (0.0..1e18).contains(&micros) { Ok(Instant(micros as u64)) } else { Err(NotARecord) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The records of a log.
    pub(super) fn records(log: &str) -> Vec<(u64, Record)> {
        let mut reader = LogReader::default();
        let record = |line| reader.line(line).unwrap_or_else(|_| panic!("{line}"));
        log.lines().filter_map(record).map(|(at, record)| (at.0, record)).collect()
    }

    pub(super) fn frame(id: u16, data: &[u8]) -> Record {
        Record::Frame(Frame::new(id, data).unwrap())
    }

    #[test]
    fn explanations_of_an_error_frame_and_comments_are_no_records() {
        let log = "# recorded at night\ncan0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\n\
                   \tcontroller-problem{rx-error-warning}\ncan0  701   [1]  05\n";
        let found = records(log);
        assert_eq!(found.len(), 2);
        assert!(matches!(&found[0].1, Record::Foreign(Foreign { kind: ForeignKind::Error, .. })));
        assert_eq!(found[1].1, frame(0x701, &[5]));
    }

    #[test]
    fn a_byte_order_mark_before_a_log_is_skipped() {
        for log in ["(1.0) vcan0 701#05", "can0 701 [1] 05", "# night\n(1.0) can0 701#05"] {
            assert_eq!(records(&format!("\u{FEFF}{log}")), records(log), "{log}");
        }
        let log = ";$FILEVERSION=1.1\n;   ---\n     1)        12.3  Rx         0701  1  05";
        assert_eq!(records(&format!("\u{FEFF}{log}")), records(log));
    }

    #[test]
    fn a_line_that_is_no_record_is_refused_in_every_form() {
        for head in ["", "base hex  timestamps absolute\n", ";$FILEVERSION=1.1\n"] {
            let mut reader = LogReader::default();
            head.lines().for_each(|line| assert_eq!(reader.line(line), Ok(None)));
            assert_eq!(reader.line("nonsense all over"), Err(NotARecord), "{head}");
        }
    }
}
