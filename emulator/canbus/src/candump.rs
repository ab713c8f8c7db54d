//! The text form in which can-utils logs traffic: `(1.000000) vcan0 123#DEADBEEF`.

use std::fmt;
use std::str::FromStr;

use crate::{ExtendedId, Frame, Id, StandardId, Time};

/// One line of `candump -L`: the time, the interface and the frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// The instant, to the microsecond.
    pub at: Time,
    /// The name of the interface.
    pub interface: String,
    /// The frame.
    pub frame: Frame,
}

/// The line is no record of a classic CAN frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotARecord;

impl fmt::Display for NotARecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("not a candump record of a classic CAN frame")
    }
}

impl std::error::Error for NotARecord {}

/// `123#DEADBEEF`, `12345678#`, `123#R4`.
impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id() {
            Id::Standard(id) => write!(f, "{:03X}#", id.as_raw())?,
            Id::Extended(id) => write!(f, "{:08X}#", id.as_raw())?,
        }
        match self.is_remote() {
            true if self.dlc() == 0 => f.write_str("R"),
            true => write!(f, "R{}", self.dlc()),
            false => self.bytes().iter().try_for_each(|byte| write!(f, "{byte:02X}")),
        }
    }
}

impl FromStr for Frame {
    type Err = NotARecord;

    fn from_str(text: &str) -> Result<Frame, NotARecord> {
        let (id, content) = text.split_once('#').ok_or(NotARecord)?;
        let id = parse_id(id).ok_or(NotARecord)?;
        let frame = match content.strip_prefix(['R', 'r']) {
            Some("") => Frame::remote(id, 0),
            Some(dlc) => dlc.parse().ok().and_then(|dlc| Frame::remote(id, dlc)),
            None => parse_bytes(content).and_then(|bytes| Frame::data(id, &bytes)),
        };
        frame.ok_or(NotARecord)
    }
}

/// Three digits are a base identifier, eight digits an extended identifier.
fn parse_id(digits: &str) -> Option<Id> {
    let raw = parse_hex(digits)?;
    match digits.len() {
        3 => StandardId::new(raw as u16).map(Id::from),
        8 => ExtendedId::new(raw).map(Id::from),
        _ => None,
    }
}

fn parse_bytes(digits: &str) -> Option<Vec<u8>> {
    let pairs = digits.as_bytes().chunks(2);
    pairs.map(|pair| Some(parse_hex(str::from_utf8(pair).ok().filter(|p| p.len() == 2)?)? as u8)).collect()
}

fn parse_hex(digits: &str) -> Option<u32> {
    let all_hex = digits.bytes().all(|digit| digit.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| all_hex)
}

impl fmt::Display for Record {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({}) {} {}", self.at, self.interface, self.frame)
    }
}

impl FromStr for Record {
    type Err = NotARecord;

    fn from_str(line: &str) -> Result<Record, NotARecord> {
        let mut words = line.split_whitespace();
        let mut word = || words.next().ok_or(NotARecord);
        let at = word()?.strip_prefix('(').and_then(|word| word.strip_suffix(')')).ok_or(NotARecord)?;
        Ok(Record { at: parse_time(at)?, interface: word()?.to_owned(), frame: word()?.parse()? })
    }
}

fn parse_time(text: &str) -> Result<Time, NotARecord> {
    let (seconds, micros) = text.split_once('.').ok_or(NotARecord)?;
    let number = |digits: &str| digits.parse::<u64>().map_err(|_| NotARecord);
    if micros.len() != 6 {
        return Err(NotARecord);
    }
    Ok(Time(number(seconds)?.checked_mul(Time::PER_SECOND).ok_or(NotARecord)?)
        + Time::from_micros(number(micros)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_as_can_utils_writes_them() {
        for line in [
            "(0.000000) vcan0 000#",
            "(1.000000) vcan0 123#DEADBEEF",
            "(12.345678) can1 1234ABCD#0011223344556677",
            "(7.000001) vcan0 581#R8",
            "(7.000001) vcan0 705#R",
        ] {
            assert_eq!(line.parse::<Record>().unwrap().to_string(), line);
        }
    }

    #[test]
    fn lines_without_a_record_are_refused() {
        for line in [
            "",
            "(1.0) vcan0 123#00",
            "1.000000 vcan0 123#00",
            "(1.000000) vcan0",
            "(1.000000) vcan0 800#00",
            "(1.000000) vcan0 12#00",
            "(1.000000) vcan0 123#0",
            "(1.000000) vcan0 123#001122334455667788",
            "(1.000000) vcan0 123#R9",
            "(1.000000) vcan0 123##100",
            "(1.000000) vcan0 12345678#+1",
        ] {
            assert_eq!(line.parse::<Record>(), Err(NotARecord), "{line}");
        }
    }
}
