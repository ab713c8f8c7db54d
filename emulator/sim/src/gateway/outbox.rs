//! Bytes that wait for a client to read them: bounded, in order, and partly in separate segments.

use std::collections::VecDeque;
use std::io::{self, ErrorKind, Write};
use std::ops::Range;
use std::time::{Duration, Instant};

/// Maximum number of waiting bytes. Like a kernel's CAN socket, a full outbox drops further frames.
const MOST: usize = 64 * 1024;

/// Maximum memory of an empty outbox in bytes.
const KEPT: usize = 1024;

/// The pause after a separate segment, unless the client sends something earlier. TCP keeps no message boundaries, and
/// python-can takes whatever one `recv` returns as the answer. So nothing may follow an answer before the client has
/// read it, which may take long on a busy host.
const SEGMENT_GAP: Duration = Duration::from_millis(250);

/// Bytes to send to one client.
#[derive(Debug, Default)]
pub(super) struct Outbox {
    waiting: VecDeque<u8>,
    /// Bytes written since the client connected.
    written: u64,
    /// Positions of the separate segments, on the same scale as `written`.
    segments: VecDeque<Range<u64>>,
    /// The end of the pause after a segment.
    silent_until: Option<Instant>,
}

impl Outbox {
    /// Whether the outbox accepts a further message.
    pub(super) fn has_room(&self) -> bool {
        self.waiting.len() < MOST
    }

    pub(super) fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    /// Adds text that may be joined with the text before and after it.
    pub(super) fn stream(&mut self, text: &str) {
        self.waiting.extend(text.as_bytes());
    }

    /// Adds text that the client gets in a separate segment.
    pub(super) fn segment(&mut self, text: &str) {
        let start = self.written + self.waiting.len() as u64;
        self.stream(text);
        self.segments.push_back(start..start + text.len() as u64);
    }

    /// The client has sent something, so it has read the last segment.
    pub(super) fn heard(&mut self) {
        self.silent_until = None;
    }

    /// Writes as much as the client accepts at `now`, a time of the host.
    ///
    /// # Errors
    /// The error of the connection; [`ErrorKind::WouldBlock`] when the client has to read first.
    pub(super) fn flush(&mut self, to: &mut impl Write, now: Instant) -> io::Result<()> {
        while !self.is_empty() && self.silent_until.is_none_or(|end| end <= now) {
            let (front, _) = self.waiting.as_slices();
            let length = front.len().min(self.joined());
            match to.write(&front[..length]) {
                Ok(0) => return Err(ErrorKind::WriteZero.into()),
                Ok(count) => self.wrote(count, now),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }

    /// Number of bytes for one write: up to the next segment, or to the end of the current one.
    fn joined(&self) -> usize {
        let end = self.segments.front().map_or(u64::MAX, |segment| {
            if segment.start > self.written { segment.start } else { segment.end }
        });
        usize::try_from(end - self.written).unwrap_or(usize::MAX)
    }

    fn wrote(&mut self, count: usize, now: Instant) {
        self.waiting.drain(..count);
        self.written += count as u64;
        if self.segments.pop_front_if(|segment| segment.end <= self.written).is_some() {
            self.silent_until = Some(now + SEGMENT_GAP);
        }
        if self.is_empty() {
            self.waiting.shrink_to(KEPT);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A client that accepts this many bytes per write and blocks after this number of writes.
    struct Narrow {
        width: usize,
        writes: usize,
        got: Vec<Vec<u8>>,
    }

    impl Write for Narrow {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.writes = self.writes.checked_sub(1).ok_or(ErrorKind::WouldBlock)?;
            let bytes = &bytes[..bytes.len().min(self.width)];
            self.got.push(bytes.to_vec());
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn wide() -> Narrow {
        Narrow { width: usize::MAX, writes: usize::MAX, got: Vec::new() }
    }

    #[test]
    fn a_segment_is_sent_alone_and_further_frames_wait() {
        let (mut outbox, mut client, now) = (Outbox::default(), wide(), Instant::now());
        outbox.stream("a");
        outbox.stream("b");
        outbox.segment("ok");
        outbox.stream("c");
        outbox.flush(&mut client, now).unwrap();
        assert_eq!(client.got, [b"ab", b"ok"]);
        outbox.flush(&mut client, now + SEGMENT_GAP / 2).unwrap();
        assert_eq!(client.got.len(), 2);
        outbox.flush(&mut client, now + SEGMENT_GAP).unwrap();
        assert_eq!(client.got[2], b"c");
        assert!(outbox.is_empty());
    }

    #[test]
    fn a_client_that_speaks_has_read() {
        let (mut outbox, mut client, now) = (Outbox::default(), wide(), Instant::now());
        outbox.segment("hi");
        outbox.flush(&mut client, now).unwrap();
        outbox.heard();
        outbox.segment("ok");
        outbox.flush(&mut client, now).unwrap();
        assert_eq!(client.got, [b"hi", b"ok"]);
    }

    #[test]
    fn a_segment_that_is_written_in_parts_is_one_segment() {
        let mut client = Narrow { width: 1, ..wide() };
        let (mut outbox, now) = (Outbox::default(), Instant::now());
        outbox.segment("ok");
        outbox.segment("hi");
        outbox.flush(&mut client, now).unwrap();
        assert_eq!(client.got.concat(), b"ok");
    }

    #[test]
    fn a_client_that_does_not_read_fills_the_outbox_and_the_memory_is_freed() {
        let mut client = Narrow { writes: 0, ..wide() };
        let (mut outbox, now) = (Outbox::default(), Instant::now());
        while outbox.has_room() {
            outbox.stream("< frame 123 1.000000 DEADBEEF >");
        }
        assert_eq!(outbox.flush(&mut client, now).unwrap_err().kind(), ErrorKind::WouldBlock);
        assert!(outbox.waiting.len() < MOST + 100);
        outbox.flush(&mut wide(), now).unwrap();
        assert!(outbox.is_empty() && outbox.has_room() && outbox.waiting.capacity() <= 2 * KEPT);
    }
}
