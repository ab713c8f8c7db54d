//! The objects as the server sees them, and the two ends of a transfer: the source of an upload and the sink of a download.

use super::{Abort, Bytes, Multiplexer, crc};
use crate::copy::copy;
use crate::{Instant, Part};

/// The longest value that is handed over in one piece, and how much of a stream is: whole segments, and whole words for
/// the CRC and for copies.
pub(crate) const BUFFER: usize = 112;

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
    /// Whether there are block uploads.
    const BLOCK_UPLOAD: bool;

    /// The value of an entry.
    fn read(&self, at: Multiplexer) -> Result<&[u8], Abort>;
    /// How the entry can be written, if it can be at all.
    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort>;
    /// Replaces the value of an entry and does what follows from it.
    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Instant) -> Result<(), Abort>;
    /// Whether the response to the write just made has to wait for [`Server::release`](super::Server::release); once.
    fn take_deferred(&mut self) -> bool;
    /// Hands over a part of a domain.
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
    pub(super) fn new(at: Multiplexer, value: &[u8], buffer: &mut [u8; BUFFER]) -> Source {
        let len = value.len();
        if let Some(place) = buffer.get_mut(..len) {
            copy(place, value);
        }
        Source { at, len }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The length in a frame.
    pub(super) fn size(&self) -> u32 {
        u32::try_from(self.len).unwrap_or(u32::MAX)
    }

    /// All of it. Fails when the domain has become shorter.
    pub(super) fn content<'a>(
        &self,
        buffer: &'a [u8; BUFFER],
        objects: &'a impl Objects,
    ) -> Result<&'a [u8], Abort> {
        let content = if self.len <= BUFFER { buffer } else { objects.read(self.at)? };
        content.get(..self.len).ok_or(Abort::General)
    }

    /// The next up to seven bytes.
    pub(super) fn piece(
        &self,
        offset: usize,
        buffer: &[u8; BUFFER],
        objects: &impl Objects,
    ) -> Result<Bytes<7>, Abort> {
        let content = self.content(buffer, objects)?;
        Ok(Bytes::from_slice(content.get(offset..).unwrap_or(&[])))
    }
}

/// A length that is no longer than the buffer.
#[allow(clippy::cast_possible_truncation)] // The buffer has 112 bytes.
const fn in_buffer(len: usize) -> u8 {
    len as u8
}

/// Where a download goes: into the buffer, from where a value is written when it is complete, and a stream goes on
/// whenever the buffer is full.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sink {
    at: Multiplexer,
    kind: Writable,
    announced: Option<usize>,
    /// The most bytes that it may have.
    limit: usize,
    /// Bytes that have gone on, and their CRC.
    gone: usize,
    crc: u16,
    /// Bytes in the buffer.
    held: u8,
    /// Up to this many bytes in the buffer, `append_direct` takes whole segments.
    direct: u8,
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
        let limit = match kind {
            Writable::Value(limit) if announced.is_some_and(|size| size > limit) => {
                return Err(Abort::TooLong);
            }
            Writable::Value(limit) => limit,
            Writable::Stream => {
                objects.stream(at, Part::Begin(announced))?;
                usize::MAX
            }
        };
        let limit = announced.map_or(limit, |size| size.min(limit));
        Ok(Sink { at, kind, announced, limit, gone: 0, crc: 0, held: 0, direct: 0 })
    }

    /// Bytes that have come.
    fn len(&self) -> usize {
        self.gone.saturating_add(self.held.into())
    }

    /// Takes up to seven bytes.
    #[inline(never)]
    pub(super) fn append(
        &mut self,
        bytes: &[u8],
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        if usize::from(self.held) + bytes.len() > self.most_held() {
            self.hand_over(buffer, objects)?;
        }
        let end = usize::from(self.held) + bytes.len();
        if end > self.most_held() {
            return Err(Abort::TooLong);
        }
        let place = buffer.get_mut(usize::from(self.held)..end).ok_or(Abort::TooLong)?;
        // With a length that the compiler knows, the copy is two words.
        match (place.first_chunk_mut::<7>(), bytes.first_chunk()) {
            (Some(place), Some(segment)) => *place = *segment,
            _ => copy(place, bytes),
        }
        self.held = in_buffer(end);
        Ok(())
    }

    /// Lets `append_direct` take at most this many segments, and no more than the buffer has room for.
    pub(super) fn allow_direct(&mut self, segments: usize) {
        self.direct = in_buffer(self.most_held().min(usize::from(self.held) + 7 * segments));
    }

    /// The most bytes that the buffer may hold, by its size and by the limit.
    fn most_held(&self) -> usize {
        self.limit.saturating_sub(self.gone).min(BUFFER)
    }

    /// Takes a whole segment if `allow_direct` has left room for it. With a length that the compiler knows, the copy is two words.
    #[inline]
    pub(super) fn append_direct(&mut self, data: &[u8; 7], buffer: &mut [u8; BUFFER]) -> bool {
        let start = usize::from(self.held);
        if start + data.len() > self.direct.into() {
            return false;
        }
        let Some(place) = buffer.get_mut(start..).and_then(|rest| rest.first_chunk_mut()) else {
            return false;
        };
        *place = *data;
        self.held = in_buffer(start + data.len());
        true
    }

    /// Passes on what is in the buffer, if it is part of a stream.
    pub(super) fn hand_over(
        &mut self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        if self.kind != Writable::Stream {
            return Ok(());
        }
        self.crc = self.crc(buffer);
        let part = Part::Data(self.gone, self.held(buffer));
        (self.gone, self.held) = (self.len(), 0);
        objects.stream(self.at, part)
    }

    fn held<'a>(&self, buffer: &'a [u8; BUFFER]) -> &'a [u8] {
        buffer.get(..self.held.into()).unwrap_or(&[])
    }

    /// CRC of all that has come.
    pub(super) fn crc(&self, buffer: &[u8; BUFFER]) -> u16 {
        crc::extend(self.crc, self.held(buffer))
    }

    pub(super) fn complete(
        &mut self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
        now: Instant,
    ) -> Result<(), Abort> {
        if self.announced.is_some_and(|size| size != self.len()) {
            return Err(Abort::TooShort);
        }
        self.hand_over(buffer, objects)?;
        match self.kind {
            Writable::Stream => objects.stream(self.at, Part::End(self.gone)),
            Writable::Value(_) => objects.write(self.at, self.held(buffer), now),
        }
    }
}
