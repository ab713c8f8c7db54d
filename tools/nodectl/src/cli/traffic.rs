//! The traffic that a command follows: that of the bus, or a log of candump, Vector (.asc) or PEAK (.trc).

use std::fs::File;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};

use canopen::{Duration, Instant};

use super::{Failure, Session};
use crate::bus::Received;
use crate::trace::{LogReader, Record};

/// The greatest length of a line of a file: ten times a line of candump.
const LONGEST_LINE: u64 = 1024;

/// The records of a log, with their times.
pub(super) struct Records {
    path: PathBuf,
    input: BufReader<Box<dyn Read>>,
    line: u64,
    reader: LogReader,
}

impl Records {
    /// Opens a file; "-" is the standard input.
    pub(super) fn open(path: &Path) -> Result<Records, Failure> {
        let input: Box<dyn Read> = if path.as_os_str() == "-" {
            Box::new(io::stdin())
        } else {
            Box::new(File::open(path).map_err(|error| Failure::file(path, error))?)
        };
        Ok(Records {
            path: path.to_owned(),
            input: BufReader::new(input),
            line: 0,
            reader: LogReader::default(),
        })
    }

    /// The record of the next line that has one; `None` at the end of the file.
    fn read(&mut self) -> Result<Option<(Instant, Record)>, Failure> {
        let mut bytes = Vec::new();
        loop {
            bytes.clear();
            self.line += 1;
            let read = (&mut self.input).take(LONGEST_LINE).read_until(b'\n', &mut bytes);
            if read.map_err(|error| Failure::file(&self.path, error))? == 0 {
                return Ok(None);
            }
            let text = String::from_utf8_lossy(&bytes);
            let record = self
                .reader
                .line(&text)
                .map_err(|error| Failure::file(&self.path, format!("line {}: {error}", self.line)))?;
            if record.is_some() {
                return Ok(record);
            }
        }
    }
}

impl Iterator for Records {
    type Item = Result<(Instant, Record), Failure>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

/// Listens to the bus for some time. The clock of the bus counts once there is one: virtual time may be faster or slower
/// than real time.
pub(super) struct Listening {
    begin: Instant,
    /// The time of the first frame.
    start: Option<Instant>,
    /// How long; `None` for ever.
    time: Option<Duration>,
    /// The longest wait for a frame.
    patience: Duration,
}

impl Listening {
    pub(super) fn begin(session: &Session, seconds: Option<u32>, patience: Duration) -> Listening {
        let time = seconds.map(|seconds| Duration::from_millis(u64::from(seconds) * 1000));
        Listening { begin: session.network.now(), start: None, time, patience }
    }

    /// The next frame, if one comes soon.
    pub(super) fn receive(&mut self, session: &mut Session) -> Result<Option<Received>, Failure> {
        let received = session.network.receive(session.network.now() + self.patience)?;
        if let Some(Received { at, .. }) = &received {
            self.start.get_or_insert(*at);
        }
        Ok(received)
    }

    /// The time of the bus, once a frame was received.
    pub(super) fn bus_time(&self, session: &Session) -> Option<Instant> {
        self.start.and_then(|_| session.network.bus_time())
    }

    pub(super) fn is_over(&self, session: &Session) -> bool {
        let times = self.start.zip(session.network.bus_time());
        let (start, now) = times.unwrap_or((self.begin, session.network.now()));
        self.time.is_some_and(|time| now.0.saturating_sub(start.0) >= time.0)
    }
}
