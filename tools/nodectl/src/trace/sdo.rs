//! SDO transfers as a listener on the bus sees them. Each transfer is one event when it has ended.

use std::collections::BTreeMap;

use canopen::client::sdo::AbortCode;
use canopen::sdo::{BlockEnd, BlockSegment, Initiate, Multiplexer, Request, Response};
use canopen::{Frame, Instant, NodeId};

use super::{Knowledge, Said, Shown, equals, hex, value};
use crate::object::Place;

/// The number of bytes of a transfer that are kept. Further bytes are only counted.
const KEPT: usize = 256;

/// The kind of transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Way {
    Expedited,
    Segments,
    Blocks,
}

/// The greatest length up to which the value of a block transfer is shown.
const SHORT: usize = 64;

/// The side whose frames are segments of a block at the moment, and have no command specifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Raw {
    Nobody,
    Client,
    Server,
}

/// A transfer under way.
#[derive(Debug)]
struct Transfer {
    at: Multiplexer,
    is_write: bool,
    way: Way,
    begun: Instant,
    data: Vec<u8>,
    length: usize,
    raw: Raw,
    /// Segments of the present block, and whether the last segment of the transfer is among them.
    block: Vec<[u8; 7]>,
    has_last: bool,
    /// Whether the client has sent all segments of a segmented download.
    is_sent: bool,
}

/// How a transfer ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum End {
    Done,
    Aborted { code: u32, by_server: bool },
    Unanswered,
}

/// A transfer that has ended.
#[derive(Debug)]
pub(crate) struct Transferred {
    pub(crate) at: Multiplexer,
    pub(crate) is_write: bool,
    way: Way,
    end: End,
    data: Vec<u8>,
    length: usize,
    /// Duration in microseconds.
    took: u64,
}

/// The transfers with the default SDO servers, one at a time for each server.
#[derive(Debug, Default)]
pub(crate) struct Transfers(BTreeMap<NodeId, Transfer>);

impl Transfers {
    /// Whether a transfer with the server of a node runs.
    pub(crate) fn has(&self, node: NodeId) -> bool {
        self.0.contains_key(&node)
    }

    /// Takes a request to a server, or its response. Returns the transfers that have ended.
    pub(crate) fn on_frame(&mut self, node: NodeId, frame: &Frame, at: Instant) -> Vec<Transferred> {
        let Ok(data) = <[u8; 8]>::try_from(frame.data()) else { return Vec::new() };
        let is_request = frame.id() >= 0x600;
        if is_request {
            self.request(node, &data, at)
        } else {
            self.response(node, data, at).into_iter().collect()
        }
    }

    fn request(&mut self, node: NodeId, data: &[u8; 8], now: Instant) -> Vec<Transferred> {
        if let Some(transfer) = self.0.get_mut(&node).filter(|transfer| transfer.raw == Raw::Client)
            && transfer.segment(*data)
        {
            return Vec::new();
        }
        let Some(request) = Request::parse(data) else { return Vec::new() };
        if let Some(transfer) = Transfer::begins(&request, now) {
            let before = self.0.insert(node, transfer);
            return before.map(|before| before.ended(End::Unanswered, now)).into_iter().collect();
        }
        let Some(transfer) = self.0.get_mut(&node) else { return Vec::new() };
        match request {
            Request::DownloadSegment(segment) => {
                transfer.take(segment.data.as_slice());
                transfer.is_sent = segment.last;
            }
            Request::BlockDownloadEnd(end) => transfer.trim(end),
            Request::BlockUploadStart => transfer.raw = Raw::Server,
            Request::BlockAcknowledge { sequence, .. } => transfer.acknowledge(sequence),
            Request::BlockUploadEnded => return self.end(node, End::Done, now).into_iter().collect(),
            Request::Abort(_, code) => {
                return self.end(node, End::Aborted { code, by_server: false }, now).into_iter().collect();
            }
            _ => (),
        }
        Vec::new()
    }

    fn response(&mut self, node: NodeId, data: [u8; 8], now: Instant) -> Option<Transferred> {
        let transfer = self.0.get_mut(&node)?;
        if transfer.raw == Raw::Server && transfer.segment(data) {
            return None;
        }
        match Response::parse(data)? {
            // A response that names another object belongs to a transfer whose request was not on this bus, or is this
            // program's own.
            Response::Downloaded(of) | Response::Uploaded(of, _) if of != transfer.at => None,
            Response::Downloaded(_) if transfer.way == Way::Expedited => self.end(node, End::Done, now),
            Response::DownloadedSegment { .. } if transfer.is_sent => self.end(node, End::Done, now),
            Response::Uploaded(_, bytes) => {
                transfer.way = Way::Expedited;
                transfer.take(bytes.as_slice());
                self.end(node, End::Done, now)
            }
            Response::UploadedSegment(segment) => {
                transfer.take(segment.data.as_slice());
                if segment.last { self.end(node, End::Done, now) } else { None }
            }
            Response::UploadSegmented(..) => {
                transfer.way = Way::Segments;
                None
            }
            Response::BlockDownload(..) => {
                transfer.raw = Raw::Client;
                None
            }
            Response::BlockAcknowledge(sequence, _) => {
                transfer.acknowledge(sequence);
                None
            }
            Response::BlockDownloaded => self.end(node, End::Done, now),
            Response::BlockUploadEnd(end) => {
                transfer.trim(end);
                None
            }
            Response::Abort(_, code) => self.end(node, End::Aborted { code, by_server: true }, now),
            _ => None,
        }
    }

    fn end(&mut self, node: NodeId, end: End, now: Instant) -> Option<Transferred> {
        self.0.remove(&node).map(|transfer| transfer.ended(end, now))
    }
}

/// The first frame of a transfer whose begin is not in the trace, or that is no SDO message.
pub(super) fn without_begin(frame: &Frame) -> Said {
    Said::text(format!("transfer without its begin: {}", hex(frame)))
}

impl Transfer {
    /// The transfer that a request begins; `None` for a request within one.
    fn begins(request: &Request, begun: Instant) -> Option<Transfer> {
        let new = |at, is_write, way, bytes: &[u8]| Transfer {
            at,
            is_write,
            way,
            begun,
            data: bytes.to_vec(),
            length: bytes.len(),
            raw: Raw::Nobody,
            block: Vec::new(),
            has_last: false,
            is_sent: false,
        };
        Some(match *request {
            Request::Download(at, Initiate::Expedited(bytes)) => {
                new(at, true, Way::Expedited, bytes.as_slice())
            }
            Request::Download(at, Initiate::Unsized(bytes)) => new(at, true, Way::Expedited, &bytes),
            Request::Download(at, Initiate::Segmented(_)) => new(at, true, Way::Segments, &[]),
            Request::BlockDownload { at, .. } => new(at, true, Way::Blocks, &[]),
            Request::Upload(at) => new(at, false, Way::Expedited, &[]),
            Request::BlockUpload { at, .. } => new(at, false, Way::Blocks, &[]),
            _ => return None,
        })
    }

    /// Takes a segment of a block; `false` for an abort, which cannot be mistaken for a segment.
    fn segment(&mut self, data: [u8; 8]) -> bool {
        let Some(segment) = BlockSegment::parse(data) else { return false };
        // After a gap, the segments are ignored, because the sender repeats them.
        if usize::from(segment.sequence.get()) == self.block.len() + 1 {
            self.block.push(segment.data);
            self.has_last = segment.last;
        }
        true
    }

    /// Takes the acknowledged segments of the block; the sender repeats the others.
    fn acknowledge(&mut self, sequence: u8) {
        let whole = usize::from(sequence) == self.block.len();
        for segment in std::mem::take(&mut self.block).iter().take(sequence.into()) {
            self.take(segment);
        }
        if std::mem::take(&mut self.has_last) && whole {
            self.raw = Raw::Nobody;
        }
    }

    fn take(&mut self, bytes: &[u8]) {
        self.length += bytes.len();
        let room = KEPT.saturating_sub(self.data.len());
        self.data.extend(bytes.iter().take(room));
    }

    /// Removes the unused bytes of the last segment.
    fn trim(&mut self, end: BlockEnd) {
        self.raw = Raw::Nobody;
        self.length = self.length.saturating_sub(end.unused.into());
        self.data.truncate(self.length);
    }

    fn ended(self, end: End, now: Instant) -> Transferred {
        let Transfer { at, is_write, way, data, length, begun, .. } = self;
        Transferred { at, is_write, way, end, data, length, took: now.0.saturating_sub(begun.0) }
    }
}

impl Transferred {
    /// The bytes that the object has now; `None` where the transfer failed or was too long to keep.
    pub(crate) fn value(&self) -> Option<&[u8]> {
        (self.end == End::Done && self.length == self.data.len()).then_some(&self.data)
    }

    /// The bytes that a client has read.
    pub(crate) fn read(&self) -> Option<&[u8]> {
        self.value().filter(|_| !self.is_write)
    }

    pub(super) fn say(&self, known: &Knowledge, node: NodeId) -> Said {
        let verb = if self.is_write { "write" } else { "read" };
        let name = known.catalogue().name(self.at).unwrap_or_default();
        let bare = Shown { at: self.at, name: name.clone(), value: None, unit: String::new(), meaning: None };
        let object =
            if name.is_empty() { Place(self.at).to_string() } else { format!("{} {name}", Place(self.at)) };
        let (text, value, abort) = match self.end {
            End::Aborted { code, by_server } => {
                let who = if by_server { "refused" } else { "given up" };
                (format!("{verb} {object}: {who}, {}", AbortCode(code)), bare, Some(code))
            }
            End::Unanswered => (format!("{verb} {object}: no answer"), bare, None),
            End::Done => match self.value().filter(|bytes| self.way != Way::Blocks || bytes.len() <= SHORT) {
                Some(bytes) => {
                    let value = value(known, known.catalogue(), node, self.at, bytes);
                    (format!("{verb} {object}{}{}", equals(&value), self.how()), value, None)
                }
                None => (format!("{verb} {object}: {} bytes{}", self.length, self.how()), bare, None),
            },
        };
        Said { text, values: vec![value], abort }
    }

    /// The kind of transfer, with the duration if there were several frames.
    fn how(&self) -> String {
        let time = format!("{}.{:03} ms", self.took / 1000, self.took % 1000);
        match self.way {
            Way::Expedited => String::new(),
            Way::Segments => format!(" (segments, {time})"),
            Way::Blocks => format!(" (blocks, {time})"),
        }
    }
}
