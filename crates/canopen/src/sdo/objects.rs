//! The interface of the server to the objects, and the two ends of a transfer: the source of an upload and the sink of
//! a download.

use super::{Abort, Bytes, Multiplexer, crc};
use crate::Tick;
use crate::copy::copy;

/// Size of the buffer in bytes: the longest value, and the longest part of a stream. A multiple of a segment (7), and
/// of a word (4) for the CRC and for copies.
pub(crate) const BUFFER: usize = 112;

/// A part of a download to a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part<'a> {
    /// The download begins. The number of bytes, if the client announces it.
    Begin(Option<usize>),
    /// Some bytes, and the offset of the first one in the domain.
    Data(usize, &'a [u8]),
    /// The download is complete, with this number of bytes.
    End(usize),
}

/// How an entry accepts a download.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Writable {
    /// The entry takes one value of at most this many bytes.
    Value(usize),
    /// The entry is a domain and takes its content in parts.
    Stream,
}

/// The dictionary with its values and rules, as the server uses it.
pub trait Objects {
    /// Whether block uploads are supported.
    const BLOCK_UPLOAD: bool;
    /// Whether block downloads are supported.
    const BLOCK_DOWNLOAD: bool;
    /// Whether domains can be uploaded in parts, and the end of an incomplete transfer is reported.
    const PARTS: bool;
    /// Free places in the transmit queue that a block upload leaves.
    const RESERVED_ROOM: usize;

    /// The value of an entry. The application may set it before.
    fn read(&mut self, at: Multiplexer) -> Result<&[u8], Abort>;
    /// How the entry accepts a download, or why it does not.
    fn writable(&self, at: Multiplexer) -> Result<Writable, Abort>;
    /// Replaces the value of an entry and applies its effect.
    fn write(&mut self, at: Multiplexer, bytes: &[u8], now: Tick) -> Result<(), Abort>;
    /// Whether the response to the latest write has to wait for [`Server::release`](super::Server::release). Returns
    /// `true` once.
    fn take_deferred(&mut self) -> bool;
    /// Hands over a part of a domain.
    fn stream(&mut self, at: Multiplexer, part: Part<'_>) -> Result<(), Abort>;
    /// A download of a domain has ended before it was complete.
    fn abandon(&mut self, at: Multiplexer);
    /// Begins an upload in parts. Returns the length; `None` for an entry that [`read`](Objects::read) gives as a whole.
    fn open(&mut self, at: Multiplexer) -> Result<Option<usize>, Abort>;
    /// Fills `part` with the content from `offset` on.
    fn part(&mut self, at: Multiplexer, offset: usize, part: &mut [u8]) -> Result<(), Abort>;
    /// An upload in parts has ended.
    fn close(&mut self, at: Multiplexer, is_complete: bool);
}

/// The data of an upload. A value that fits the buffer is copied there, so that it cannot change during the transfer. A
/// longer value (a domain) is read part by part.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    at: Multiplexer,
    len: usize,
    /// For an upload in parts, the offset of the part in the buffer; [`NO_PART`] before the first one.
    part: Option<usize>,
}

/// An offset beyond every domain: the buffer contains no part of one.
const NO_PART: usize = usize::MAX;

impl Source {
    pub(super) fn new(at: Multiplexer, value: &[u8], buffer: &mut [u8; BUFFER]) -> Source {
        let len = value.len();
        if let Some(place) = buffer.get_mut(..len) {
            copy(place, value);
        }
        Source { at, len, part: None }
    }

    /// An upload in parts.
    pub(super) fn in_parts(at: Multiplexer, len: usize) -> Source {
        Source { at, len, part: Some(NO_PART) }
    }

    pub(super) fn is_in_parts(&self) -> bool {
        self.part.is_some()
    }

    /// The upload has ended.
    pub(super) fn close(&self, is_complete: bool, objects: &mut impl Objects) {
        if self.is_in_parts() {
            objects.close(self.at, is_complete);
        }
    }

    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// The length as a number in a frame.
    pub(super) fn size(&self) -> u32 {
        u32::try_from(self.len).unwrap_or(u32::MAX)
    }

    /// All data. Fails when the domain has become shorter.
    pub(super) fn content<'a>(
        &self,
        buffer: &'a [u8; BUFFER],
        objects: &'a mut impl Objects,
    ) -> Result<&'a [u8], Abort> {
        let content = if self.len <= BUFFER { buffer } else { objects.read(self.at)? };
        content.get(..self.len).ok_or(Abort::General)
    }

    /// The next bytes of an upload in parts. The buffer holds 16 segments, so no segment is in two parts.
    #[inline(never)]
    pub(super) fn piece(
        &mut self,
        offset: usize,
        buffer: &mut [u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<Bytes<7>, Abort> {
        let len = |start: usize| self.len.saturating_sub(start).min(BUFFER);
        let held = self.part.filter(|start| *start <= offset && offset - *start < BUFFER);
        let start = held.unwrap_or(offset);
        if held.is_none() {
            self.part = Some(NO_PART);
            objects.part(self.at, start, buffer.get_mut(..len(start)).unwrap_or_default())?;
            self.part = Some(start);
        }
        Ok(Bytes::from_slice(buffer.get(offset - start..len(start)).unwrap_or_default()))
    }
}

/// Converts a length that is not larger than the buffer.
#[allow(clippy::cast_possible_truncation)] // The buffer has 112 bytes.
const fn in_buffer(len: usize) -> u8 {
    len as u8
}

/// The room for a download.
// Checked before there is a destination: a destination in a result would be copied.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    is_stream: bool,
    limit: usize,
}

impl Room {
    /// Begins a download. `TooLong` when the client announces more bytes than there is room for.
    pub(super) fn of(at: Multiplexer, size: Option<u32>, objects: &mut impl Objects) -> Result<Room, Abort> {
        let announced = size.map(|size| usize::try_from(size).unwrap_or(usize::MAX));
        let (is_stream, most) = match objects.writable(at)? {
            Writable::Value(most) => (false, most),
            Writable::Stream => (true, usize::MAX),
        };
        let limit = announced.unwrap_or(most);
        if limit > most {
            return Err(Abort::TooLong);
        }
        if is_stream {
            objects.stream(at, Part::Begin(announced))?;
        }
        Ok(Room { is_stream, limit })
    }
}

/// The destination of a download. A value is collected in the buffer and written when it is complete. The data of a
/// stream is passed on whenever the buffer is full.
#[derive(Clone, Copy, Debug)]
#[repr(align(4))]
pub(super) struct Sink {
    at: Multiplexer,
    is_stream: bool,
    /// Whether the client has announced the number of bytes, which is the limit then.
    is_announced: bool,
    /// The maximum number of bytes of this download.
    limit: usize,
    /// Number of bytes that have been passed on, and their CRC.
    gone: usize,
    crc: u16,
    /// Number of bytes in the buffer.
    held: u8,
    /// Up to this number of bytes in the buffer, `append_direct` takes whole segments.
    direct: u8,
}

impl Sink {
    /// The destination for a download. `size`: the number of bytes, if the client announces it.
    pub(super) fn new(at: Multiplexer, size: Option<u32>, room: Room) -> Sink {
        let Room { is_stream, limit } = room;
        Sink { at, is_stream, is_announced: size.is_some(), limit, gone: 0, crc: 0, held: 0, direct: 0 }
    }

    /// Number of bytes received.
    fn len(&self) -> usize {
        self.gone.saturating_add(self.held.into())
    }

    /// Appends up to seven bytes.
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
        copy(place, bytes);
        self.held = in_buffer(end);
        Ok(())
    }

    /// Lets `append_direct` take at most this many segments, limited by the room in the buffer.
    #[inline(never)]
    pub(super) fn allow_direct(&mut self, segments: usize) {
        self.direct = in_buffer(self.most_held().min(usize::from(self.held) + 7 * segments));
    }

    /// Lets `append_direct` take none.
    pub(super) fn forbid_direct(&mut self) {
        self.direct = 0;
    }

    /// The maximum number of bytes in the buffer, given by its size and by the limit of the download.
    #[inline(never)]
    fn most_held(&self) -> usize {
        self.limit.saturating_sub(self.gone).min(BUFFER)
    }

    /// Appends a whole segment, if `allow_direct` has left room for it. A copy of a length that is known at compile
    /// time takes two words.
    #[inline]
    pub(super) fn append_direct(&mut self, data: &[u8; 7], buffer: &mut [u8; BUFFER]) -> bool {
        let start = usize::from(self.held);
        let end = start + data.len();
        if end > self.direct.into() {
            return false;
        }
        let Some(place) = buffer.get_mut(start..end).and_then(|place| place.first_chunk_mut()) else {
            return false;
        };
        *place = *data;
        self.held = in_buffer(end);
        true
    }

    /// Passes on the content of the buffer, if it is part of a stream.
    pub(super) fn hand_over(
        &mut self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
    ) -> Result<(), Abort> {
        if !self.is_stream {
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

    /// CRC of all bytes received.
    pub(super) fn crc(&self, buffer: &[u8; BUFFER]) -> u16 {
        crc::extend(self.crc, self.held(buffer))
    }

    /// The download has ended before it was complete.
    pub(super) fn abandon(&self, objects: &mut impl Objects) {
        if self.is_stream {
            objects.abandon(self.at);
        }
    }

    pub(super) fn complete(
        &mut self,
        buffer: &[u8; BUFFER],
        objects: &mut impl Objects,
        now: Tick,
    ) -> Result<(), Abort> {
        if self.is_announced && self.len() != self.limit {
            return Err(Abort::TooShort);
        }
        self.hand_over(buffer, objects)?;
        if self.is_stream {
            objects.stream(self.at, Part::End(self.gone))
        } else {
            objects.write(self.at, self.held(buffer), now)
        }
    }
}
