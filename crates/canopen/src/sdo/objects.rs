//! What the server serves, and the two ends of a transfer: where data comes from and where it goes.

use super::{Abort, Bytes, Multiplexer};
use crate::{Instant, Part};

/// The longest value that is handed over in one piece: a `VISIBLE_STRING` of 50 characters is the longest there is.
pub(super) const BUFFER: usize = 64;

/// How an entry takes a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Writable {
    /// As a whole, of at most this many bytes.
    Value(usize),
    /// Piece by piece: a domain.
    Stream,
}

/// The dictionary with its values and rules.
pub(crate) trait Objects {
    /// Whether there is anything worth an upload in blocks. Without, the code for it is left out of the image, and a client
    /// takes segments.
    const BLOCK_UPLOAD: bool = true;

    /// The value of an entry.
    fn read(&mut self, at: Multiplexer) -> Result<&[u8], Abort>;
    /// How the entry can be written, if it can be at all.
    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort>;
    /// Replaces the value of an entry and does what follows from it.
    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Instant) -> Result<(), Abort>;
    /// Whether the response to the write just made has to wait for [`Server::release`](super::Server::release); once.
    fn take_deferred(&mut self) -> bool;
    /// Hands over a part of a stream.
    fn stream(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort>;
}

/// Where an upload comes from. A value that fits the buffer is a snapshot: it cannot change under way. A longer one
/// (a domain) is read piece by piece.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    at: Multiplexer,
    len: usize,
}

impl Source {
    pub(super) fn open(
        at: Multiplexer,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<Source, Abort> {
        let value = objects.read(at)?;
        for (to, from) in buffer.iter_mut().zip(value) {
            *to = *from;
        }
        Ok(Source { at, len: value.len() })
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The length in a frame.
    pub(super) fn size(&self) -> u32 {
        u32::try_from(self.len).unwrap_or(u32::MAX)
    }

    /// The next up to seven bytes. Fails when the domain has become shorter.
    pub(super) fn piece(
        &self,
        offset: usize,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<Bytes<7>, Abort> {
        let value = if self.len <= BUFFER { &buffer[..] } else { objects.read(self.at)? };
        value.get(offset..self.len).map(Bytes::from_slice).ok_or(Abort::General)
    }
}

/// Where a download goes: into the buffer until it is complete, or on into the stream.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sink {
    at: Multiplexer,
    kind: Writable,
    announced: Option<usize>,
    len: usize,
}

impl Sink {
    /// `TooLong` when the client announces more than there is room for.
    pub(super) fn open(
        at: Multiplexer,
        size: Option<u32>,
        objects: &mut impl Objects,
    ) -> Result<Sink, Abort> {
        let announced = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        let kind = objects.writable(at)?;
        match kind {
            Writable::Value(limit) if announced.is_some_and(|size| size > limit) => {
                return Err(Abort::TooLong);
            }
            Writable::Value(_) => (),
            Writable::Stream => objects.stream(at, Part::Begin(announced))?,
        }
        Ok(Sink { at, kind, announced, len: 0 })
    }

    pub(super) fn append(
        &mut self,
        bytes: &[u8],
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        let end = self.len.saturating_add(bytes.len());
        if self.announced.is_some_and(|size| end > size) {
            return Err(Abort::TooLong);
        }
        match self.kind {
            Writable::Stream => objects.stream(self.at, Part::Data(self.len, bytes))?,
            Writable::Value(limit) if end <= limit => {
                let rest = buffer.get_mut(self.len..).unwrap_or(&mut []);
                rest.get_mut(..bytes.len()).ok_or(Abort::TooLong)?.copy_from_slice(bytes);
            }
            Writable::Value(_) => return Err(Abort::TooLong),
        }
        self.len = end;
        Ok(())
    }

    pub(super) fn complete(
        &self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        if self.announced.is_some_and(|size| size != self.len) {
            return Err(Abort::TooShort);
        }
        match self.kind {
            Writable::Stream => objects.stream(self.at, Part::End(self.len)),
            Writable::Value(_) => objects.write(self.at, buffer.get(..self.len).unwrap_or(&[]), now),
        }
    }
}
