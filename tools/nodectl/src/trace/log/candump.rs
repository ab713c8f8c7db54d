//! Records of candump: lines of its log (`candump -l`) or of its output, with its options for times and details.

use canopen::Instant;

use super::{ForeignKind, NotARecord, Record, classic, foreign, hex, remote};
use crate::bus::clock;

/// The flag of an error frame in an identifier (linux/can.h: CAN_ERR_FLAG).
const ERROR: u32 = 0x2000_0000;

/// The record of a line.
pub(super) fn parse(line: &str) -> Result<(Instant, Record), NotARecord> {
    let (at, rest) = time(line)?;
    let mut words = rest.split_ascii_whitespace();
    let _interface = words.next().ok_or(NotARecord)?;
    // Option -x: direction, bit rate switch, error state.
    let mut words = words.skip_while(|word| ["RX", "TX", "-", "B", "E"].contains(word));
    let record = words.next().ok_or(NotARecord)?;
    let record = match record.split_once('#') {
        Some((id, data)) => of_log(id, data),
        None => of_output(record, &words.collect::<Vec<_>>()),
    }?;
    Ok((at, record))
}

/// The time in parentheses, in seconds or as a date (option -tA), and the rest of the line; 0 without a time.
fn time(line: &str) -> Result<(Instant, &str), NotARecord> {
    let Some(rest) = line.strip_prefix('(') else { return Ok((Instant(0), line)) };
    let (time, rest) = rest.split_once(')').ok_or(NotARecord)?;
    let at = match time.split_once(' ') {
        Some((date, time)) => of_date(date, time),
        None => clock::parse(time),
    };
    at.map(|at| (at, rest)).ok_or(NotARecord)
}

/// `2026-11-25 12:00:00.250000`, as microseconds since 1970.
fn of_date(date: &str, time: &str) -> Option<Instant> {
    let numbers = |text: &str, at: char| -> Option<[u64; 3]> {
        let numbers: Vec<u64> = text.split(at).map(|part| part.parse().ok()).collect::<Option<_>>()?;
        numbers.try_into().ok()
    };
    let (whole, fraction) = time.split_once('.')?;
    let ([year, month, day], [hour, minute, second]) = (numbers(date, '-')?, numbers(whole, ':')?);
    if !(1970..10_000).contains(&year) || !(1..=12).contains(&month) || !(1..=31).contains(&day) || hour > 24
    {
        return None;
    }
    // The year begins in March, so that the leap day is its last day.
    let (year, month) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
    let days = 365 * year + year / 4 - year / 100 + year / 400 + (153 * month + 2) / 5 + day - 1;
    let days = days.checked_sub(719_468)?;
    let seconds = 86_400 * days + 3600 * hour + 60 * minute.min(59) + second.min(60);
    clock::parse(&format!("{seconds}.{fraction}"))
}

/// `701#05`, `701#R1`, `701#0102030405060708_9`, `18EBFF00#01`, `123##100`
fn of_log(id: &str, data: &str) -> Result<Record, NotARecord> {
    let (number, is_extended) = identifier(id)?;
    if number & ERROR != 0 {
        return Ok(foreign(ForeignKind::Error, 0, bytes(data)?));
    }
    if data.starts_with('#') {
        return Ok(foreign(ForeignKind::Fd, number, Vec::new()));
    }
    // The DLC of more than eight bytes.
    let data = data.split_once('_').map_or(data, |(data, _)| data);
    match data.strip_prefix('R') {
        Some("") => remote(number, is_extended, 0),
        Some(length) => remote(number, is_extended, length.parse().map_err(|_| NotARecord)?),
        None => classic(number, is_extended, bytes(data)?),
    }
}

/// `701 [1] 05`, `701 [1] remote request`, `701 {B} 01 ..`
fn of_output(id: &str, rest: &[&str]) -> Result<Record, NotARecord> {
    let [length, data @ ..] = rest else { return Err(NotARecord) };
    let (number, is_extended) = identifier(id)?;
    let is_fd = length.len() == 4;
    let length: u8 = match length.strip_prefix('{') {
        Some(code) => u8::from_str_radix(code.trim_end_matches('}'), 16).map_err(|_| NotARecord)?.min(8),
        None => {
            let digits =
                length.strip_prefix('[').and_then(|text| text.strip_suffix(']')).ok_or(NotARecord)?;
            digits.parse().map_err(|_| NotARecord)?
        }
    };
    if is_fd || length > 8 {
        return Ok(foreign(ForeignKind::Fd, number, Vec::new()));
    }
    if data.first() == Some(&"remote") {
        return remote(number, is_extended, length);
    }
    let data = bytes(&data.get(..length.into()).ok_or(NotARecord)?.concat())?;
    if data.len() != usize::from(length) {
        return Err(NotARecord);
    }
    if number & ERROR != 0 {
        return Ok(foreign(ForeignKind::Error, 0, data));
    }
    classic(number, is_extended, data)
}

/// An identifier, and whether it has 29 bits: three digits are 11 bits, eight are 29.
fn identifier(digits: &str) -> Result<(u32, bool), NotARecord> {
    match digits.len() {
        3 => Ok((hex(digits)?, false)),
        8 => Ok((hex(digits)?, true)),
        _ => Err(NotARecord),
    }
}

fn bytes(digits: &str) -> Result<Vec<u8>, NotARecord> {
    crate::value::hex_bytes(digits).ok_or(NotARecord)
}

#[cfg(test)]
mod tests {
    use super::super::Foreign;
    use super::*;
    use canopen::Frame;

    fn record(line: &str) -> (u64, Record) {
        parse(line).map_or_else(|_| panic!("{line}"), |(at, record)| (at.0, record))
    }

    #[test]
    fn logs_and_output() {
        let frame = |id, data: &[u8]| Record::Frame(Frame::new(id, data).unwrap());
        let (heartbeat, request) = (frame(0x701, &[5]), Record::Frame(Frame::remote(0x701, 1).unwrap()));
        for (line, at, expected) in [
            ("(1.5) can0 701#05", 1_500_000, &heartbeat),
            ("(1436509052.249713) vcan0 701#05 R", 1_436_509_052_249_713, &heartbeat),
            ("can0  701   [1]  05", 0, &heartbeat),
            ("(000.000001)  can0  701   [1]  05   '.'", 1, &heartbeat),
            ("(1970-01-02 00:00:01.250000)  can0  701   [1]  05", 86_401_250_000, &heartbeat),
            ("(2026-11-25 12:00:00.000000)  can0  701   [1]  05", 1_795_608_000_000_000, &heartbeat),
            ("(0.0)  can0  RX - -  701   [1]  05", 0, &heartbeat),
            ("can0  TX B E  701   [1]  05", 0, &heartbeat),
            ("(0.0) can0 080#", 0, &frame(0x80, &[])),
            ("(0.0) can0 123#0102030405060708_B", 0, &frame(0x123, &[1, 2, 3, 4, 5, 6, 7, 8])),
            ("can0 123 {B} 01 02 03 04 05 06 07 08", 0, &frame(0x123, &[1, 2, 3, 4, 5, 6, 7, 8])),
            ("(0.0) can0 701#R1", 0, &request),
            ("can0 701 [1] remote request", 0, &request),
        ] {
            assert_eq!(record(line), (at, expected.clone()), "{line}");
        }
    }

    #[test]
    fn frames_that_canopen_does_not_use_are_named() {
        for (line, kind, id) in [
            ("(0.0) can0 00000701#05", ForeignKind::Extended, 0x701),
            ("can0 00000701 [1] 05", ForeignKind::Extended, 0x701),
            ("(0.0) can0 701##105", ForeignKind::Fd, 0x701),
            ("can0  701  [01]  05", ForeignKind::Fd, 0x701),
            ("can0  701  [64]  05", ForeignKind::Fd, 0x701),
            ("(0.0) can0 20000004#0004000000000000", ForeignKind::Error, 0),
            ("can0  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME", ForeignKind::Error, 0),
        ] {
            let Record::Foreign(Foreign { kind: found, id: same, .. }) = record(line).1 else {
                panic!("{line}")
            };
            assert_eq!((found, same), (kind, id), "{line}");
        }
    }

    #[test]
    fn anything_else_is_no_record() {
        for line in [
            "can0",
            "can0 701",
            "(x) can0 701#05",
            "(1.0 can0 701#05",
            "(2026-13-01 00:00:00.0) can0 701#05",
            "(1.0) can0 801#05",
            "(1.0) can0 701#0",
            "(1.0) can0 701#+5",
            "(1.0) can0 +01#05",
            "(1.0) can0 701#R9",
            "(1.0) can0 701#010203040506070809",
            "can0 701 [2] 05",
            "can0 701 [1] 5",
            "can0 701 {x} 5",
            "(99999999999999999999.0) can0 701#05",
            "(1.\u{e9}) can0 701#05",
        ] {
            assert_eq!(parse(line), Err(NotARecord), "{line}");
        }
    }
}
