//! Logs of PEAK's tools (.trc), versions 1.0 to 2.1.

use canopen::Instant;

use super::{ForeignKind, NotARecord, Record, classic, foreign, hex, instant, remote};

/// Microseconds in a millisecond.
const MILLISECOND: f64 = 1e3;

/// The lines of the head that matter.
#[derive(Clone, Debug, Default)]
pub(super) struct Head {
    version: (u8, u8),
    /// Letters of the columns of versions 2: number, offset, type, bus, identifier, direction, reserved, length, data.
    columns: Vec<char>,
}

impl Head {
    /// A line of the head, without its semicolon.
    pub(super) fn line(&mut self, line: &str) {
        if let Some(version) = line.strip_prefix("$FILEVERSION=") {
            let mut parts = version.trim().split('.').map(|part| part.parse().unwrap_or(0));
            self.version = (parts.next().unwrap_or(1), parts.next().unwrap_or(0));
        }
        if let Some(columns) = line.strip_prefix("$COLUMNS=") {
            self.columns = columns.trim().split(',').filter_map(|column| column.chars().next()).collect();
        }
    }

    /// The columns of a record.
    fn columns(&self) -> Vec<char> {
        match self.version {
            _ if !self.columns.is_empty() => self.columns.clone(),
            (2, _) => "NOTIdlD".chars().collect(),
            (1, 3..) => "NOBTIRlD".chars().collect(),
            (1, 2) => "NOBTIlD".chars().collect(),
            (1, 1) => "NOTIlD".chars().collect(),
            _ => "NOIlD".chars().collect(),
        }
    }
}

/// The record of a line; `None` for events of the tool.
pub(super) fn parse(text: &str, head: &Head) -> Result<Option<(Instant, Record)>, NotARecord> {
    let columns = head.columns();
    let words: Vec<&str> = text.split_ascii_whitespace().collect();
    let column = |letter: char| {
        let at = columns.iter().position(|column| *column == letter)?;
        words.get(at).copied()
    };
    let at = instant(column('O').ok_or(NotARecord)?, MILLISECOND)?;
    let kind = column('T').unwrap_or("DT");
    if ["ST", "EC", "EV", "Warng"].contains(&kind) {
        return Ok(None);
    }
    if ["ER", "Error"].contains(&kind) {
        return Ok(Some((at, foreign(ForeignKind::Error, 0, Vec::new()))));
    }
    let digits = column('I').ok_or(NotARecord)?;
    let (id, is_extended) = (hex(digits)?, digits.len() > 4);
    if ["FD", "FB", "FE", "BI"].contains(&kind) {
        return Ok(Some((at, foreign(ForeignKind::Fd, id, Vec::new()))));
    }
    let length: u8 = column('l').or(column('L')).and_then(|text| text.parse().ok()).ok_or(NotARecord)?;
    let data = columns.iter().position(|column| *column == 'D').unwrap_or(columns.len());
    let data = words.get(data..).unwrap_or_default();
    if kind == "RR" || data.first() == Some(&"RTR") {
        return remote(id, is_extended, length).map(|record| Some((at, record)));
    }
    let byte = |text: &&str| hex(text).and_then(|byte| u8::try_from(byte).map_err(|_| NotARecord));
    let data = data.get(..usize::from(length.min(8))).ok_or(NotARecord)?;
    let data: Vec<u8> = data.iter().map(byte).collect::<Result<_, _>>()?;
    classic(id, is_extended, data).map(|record| Some((at, record)))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{frame, records};
    use super::super::{Foreign, ForeignKind, Record};
    use canopen::Frame;

    #[test]
    fn records_of_every_version_are_read() {
        let logs = [
            ";##########\n     1)       1841  0701  1  05\n",
            ";$FILEVERSION=1.1\n;$STARTTIME=39878.6772258947\n     1)      1841.0  Rx         0701  1  05 \n",
            ";$FILEVERSION=1.2\n     1)      1841.000 1  Rx         0701  1  05 \n",
            ";$FILEVERSION=1.3\n     1)      1841.000 1  Rx         0701 -  1    05 \n",
            ";$FILEVERSION=2.0\n      1      1841.000 DT     0701 Rx 1  05\n",
            ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n      1      1841.000 DT 1      0701 Rx -  1    05\n",
        ];
        for log in logs {
            assert_eq!(records(log), [(1_841_000, frame(0x701, &[5]))], "{log}");
        }
    }

    #[test]
    fn frames_that_canopen_does_not_use_are_named() {
        let log = ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n1 1.0 DT 1 18EBFF00 Rx - 2 01 A0\n2 2.0 FD 1 0123 Rx - 9 01\n\
                   3 3.0 ER 1 - Rx - 5 04 00 02 00 00\n4 4.0 RR 1 0701 Rx - 1\n5 5.0 ST 1 - Rx - 4 00 00 00 00\n";
        let found: Vec<Record> = records(log).into_iter().map(|(_, record)| record).collect();
        let foreign = |kind, id, data: &[u8]| Record::Foreign(Foreign { kind, id, data: data.to_vec() });
        assert_eq!(
            found,
            [
                foreign(ForeignKind::Extended, 0x18EB_FF00, &[1, 0xA0]),
                foreign(ForeignKind::Fd, 0x123, &[]),
                foreign(ForeignKind::Error, 0, &[]),
                Record::Frame(Frame::remote(0x701, 1).unwrap()),
            ]
        );
    }
}
