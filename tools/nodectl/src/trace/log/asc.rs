//! Logs of Vector's tools (.asc): `0.015991 1 701 Rx d 1 05`.

use canopen::Instant;

use super::{ForeignKind, NotARecord, Record, classic, foreign, hex, instant, remote};

/// Microseconds in a second.
const SECOND: f64 = 1e6;

/// The line `base hex timestamps absolute`.
#[derive(Debug)]
pub(super) struct Head {
    radix: u32,
    is_relative: bool,
}

impl Head {
    pub(super) fn parse(text: &str) -> Option<Head> {
        let text = text.to_ascii_lowercase();
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let ["base", base, rest @ ..] = &words[..] else { return None };
        let radix = if *base == "dec" { 10 } else { 16 };
        Some(Head { radix, is_relative: rest.contains(&"relative") })
    }
}

/// The record of a line; `None` for events of the tool.
pub(super) fn parse(text: &str, head: &Head, last: Instant) -> Result<Option<(Instant, Record)>, NotARecord> {
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let ["begin" | "Begin" | "end" | "End" | "internal" | "no", ..] = words[..] else {
        let [time, rest @ ..] = &words[..] else { return Ok(None) };
        let at = instant(time, SECOND)?;
        let at = if head.is_relative { Instant(last.0.saturating_add(at.0)) } else { at };
        return Ok(record(rest, head)?.map(|record| (at, record)));
    };
    Ok(None)
}

/// The text behind the time: `1 701 Rx d 1 05`, `1 701 Rx r`, `1 ErrorFrame`, `CANFD 1 Rx 701 ..`, `Start of measurement`.
fn record(words: &[&str], head: &Head) -> Result<Option<Record>, NotARecord> {
    match words {
        ["CANFD", _channel, _direction, id, ..] => {
            let (id, _) = identifier(id, head)?;
            Ok(Some(foreign(ForeignKind::Fd, id, Vec::new())))
        }
        [_channel, "ErrorFrame", ..] => Ok(Some(foreign(ForeignKind::Error, 0, Vec::new()))),
        [_channel, id, "Rx" | "Tx" | "TxRq", "r", rest @ ..] => {
            let (id, is_extended) = identifier(id, head)?;
            let length = rest.first().and_then(|length| length.parse().ok()).unwrap_or(0);
            remote(id, is_extended, length).map(Some)
        }
        [_channel, id, "Rx" | "Tx" | "TxRq", "d", length, data @ ..] => {
            let (id, is_extended) = identifier(id, head)?;
            let length = length.parse::<usize>().map_err(|_| NotARecord)?.min(8);
            let byte = |text: &&str| u8::from_str_radix(text, head.radix).map_err(|_| NotARecord);
            let data: Vec<u8> =
                data.get(..length).ok_or(NotARecord)?.iter().map(byte).collect::<Result<_, _>>()?;
            classic(id, is_extended, data).map(Some)
        }
        // Statistics, state of the chip, start of the measurement, and events of other buses.
        _ => Ok(None),
    }
}

/// An identifier; one of 29 bits ends with x.
fn identifier(text: &str, head: &Head) -> Result<(u32, bool), NotARecord> {
    let (digits, is_extended) = text.strip_suffix('x').map_or((text, false), |digits| (digits, true));
    let id = if head.radix == 16 { hex(digits)? } else { digits.parse().map_err(|_| NotARecord)? };
    Ok((id, is_extended))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{frame, records};
    use super::super::{Foreign, ForeignKind, Record};
    use canopen::Frame;

    #[test]
    fn frames_of_all_kinds_are_read() {
        let log = "date Wed Nov 25 08:00:00.000 2026\nbase hex  timestamps absolute\ninternal events logged\n\
                   // version 9.0.0\nBegin Triggerblock Wed Nov 25 08:00:00.000 2026\n   0.000000 Start of measurement\n   \
                   0.015991 1  701             Rx   d 1 05  Length = 120000 BitCount = 62\n   0.100000 1  18EBFF00x       Rx   \
                   d 2 01 A0\n   0.200000 1  701             Rx   r\n   0.300000 1  ErrorFrame\n   0.400000 CANFD   1 Rx 123 1 0 8 8 00\n\
                   0.500000 1  Statistic: D 0 R 0\nEnd TriggerBlock\n";
        let found = records(log);
        assert_eq!(found[0], (15_991, frame(0x701, &[5])));
        let foreign = |kind, id, data: &[u8]| Record::Foreign(Foreign { kind, id, data: data.to_vec() });
        assert_eq!(found[1].1, foreign(ForeignKind::Extended, 0x18EB_FF00, &[1, 0xA0]));
        assert_eq!(found[2].1, Record::Frame(Frame::remote(0x701, 0).unwrap()));
        assert_eq!(found[3], (300_000, foreign(ForeignKind::Error, 0, &[])));
        assert_eq!(found[4].1, foreign(ForeignKind::Fd, 0x123, &[]));
        assert_eq!(found.len(), 5);
    }

    #[test]
    fn numbers_may_be_decimal_and_times_relative() {
        let log = "base dec timestamps relative\n0.5 1 1793 Rx d 2 10 255\n0.25 1 1793 Rx d 1 5\n";
        assert_eq!(records(log), [(500_000, frame(0x701, &[10, 255])), (750_000, frame(0x701, &[5]))]);
    }
}
