//! Records of candump: lines of its log (`candump -l`) or of its output.

use canopen::{Frame, Instant};

use crate::bus::clock;

/// The line is no record.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no record of candump, as (1.000000) can0 701#05 or can0 701 [1] 05")]
pub struct NotARecord;

/// The frame of a line; `Ok(None)` for a frame that is not CANopen: a 29-bit identifier, CAN FD, an error frame.
///
/// # Errors
/// The line is no record.
pub fn parse(line: &str) -> Result<Option<(Instant, Frame)>, NotARecord> {
    let mut words = line.split_ascii_whitespace().peekable();
    let at = match words.peek().and_then(|word| word.strip_prefix('(')?.strip_suffix(')')) {
        Some(time) => {
            words.next();
            clock::parse(time).ok_or(NotARecord)?
        }
        None => Instant(0),
    };
    let (_interface, record) = (words.next().ok_or(NotARecord)?, words.next().ok_or(NotARecord)?);
    let rest: Vec<&str> = words.collect();
    match record.split_once('#') {
        Some((id, data)) => of_log(id, data),
        None => of_output(record, &rest),
    }
    .map(|frame| frame.map(|frame| (at, frame)))
}

/// `701#05`, `701#R1`
fn of_log(id: &str, data: &str) -> Result<Option<Frame>, NotARecord> {
    if id.len() != 3 || data.starts_with('#') {
        return number(id).map(|_| None);
    }
    let id = base(id)?;
    let frame = match data.strip_prefix('R') {
        Some("") => Frame::remote(id, 0),
        Some(length) => Frame::remote(id, length.parse().map_err(|_| NotARecord)?),
        None => Frame::new(id, &bytes(data)?),
    };
    frame.map(Some).ok_or(NotARecord)
}

/// `701 [1] 05`, `701 [1] remote request`
fn of_output(id: &str, rest: &[&str]) -> Result<Option<Frame>, NotARecord> {
    let [length, data @ ..] = rest else { return Err(NotARecord) };
    let length: u8 =
        length.strip_prefix('[').and_then(|text| text.strip_suffix(']')?.parse().ok()).ok_or(NotARecord)?;
    if id.len() != 3 || length > 8 {
        return number(id).map(|_| None);
    }
    let id = base(id)?;
    let frame = if data.first() == Some(&"remote") {
        Frame::remote(id, length)
    } else {
        let data = bytes(&data.get(..length.into()).ok_or(NotARecord)?.concat())?;
        Frame::new(id, &data).filter(|frame| frame.len() == usize::from(length))
    };
    frame.map(Some).ok_or(NotARecord)
}

fn base(id: &str) -> Result<u16, NotARecord> {
    number(id)
        .and_then(|id| u16::try_from(id).map_err(|_| NotARecord))
        .and_then(|id| if id < 0x800 { Ok(id) } else { Err(NotARecord) })
}

fn number(digits: &str) -> Result<u32, NotARecord> {
    let is_plain = digits.bytes().all(|byte| byte.is_ascii_hexdigit());
    u32::from_str_radix(digits, 16).ok().filter(|_| is_plain).ok_or(NotARecord)
}

fn bytes(digits: &str) -> Result<Vec<u8>, NotARecord> {
    crate::value::hex_bytes(digits).ok_or(NotARecord)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(line: &str) -> Option<(u64, Frame)> {
        parse(line).unwrap().map(|(at, frame)| (at.0, frame))
    }

    #[test]
    fn logs_and_output() {
        let heartbeat = Frame::new(0x701, &[5]).unwrap();
        assert_eq!(frame("(1.5) can0 701#05"), Some((1_500_000, heartbeat)));
        assert_eq!(frame("(1436509052.249713) vcan0 701#05 R"), Some((1_436_509_052_249_713, heartbeat)));
        assert_eq!(frame("  can0  701   [1]  05"), Some((0, heartbeat)));
        assert_eq!(frame("(000.000001)  can0  701   [1]  05   '.'"), Some((1, heartbeat)));
        assert_eq!(frame("(0.0) can0 080#"), Some((0, Frame::new(0x80, &[]).unwrap())));
        assert_eq!(frame("(0.0) can0 701#R1"), Some((0, Frame::remote(0x701, 1).unwrap())));
        assert_eq!(frame("can0 701 [1] remote request"), Some((0, Frame::remote(0x701, 1).unwrap())));
        for line in ["(0.0) can0 00000701#05", "(0.0) can0 701##105", "can0 00000701 [1] 05"] {
            assert_eq!(frame(line), None, "{line}");
        }
    }

    #[test]
    fn anything_else_is_no_record() {
        for line in [
            "",
            "can0",
            "can0 701",
            "(x) can0 701#05",
            "(1.0) can0 801#05",
            "(1.0) can0 701#0",
            "(1.0) can0 701#+5",
            "(1.0) can0 +01#05",
            "(1.0) can0 701#R9",
            "(1.0) can0 701#010203040506070809",
            "can0 701 [2] 05",
            "can0 701 [1] 5",
            "(99999999999999999999.0) can0 701#05",
            "(1.\u{e9}) can0 701#05",
        ] {
            assert_eq!(parse(line), Err(NotARecord), "{line}");
        }
    }
}
