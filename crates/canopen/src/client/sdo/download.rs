//! Expedited and segmented download (CiA 301, 7.2.4.3.3 and 7.2.4.3.4).

use super::link::{Channel, Link};
use super::transfer::{self, Progress, Transfer};
use super::{Download, Error, Options};
use crate::Instant;
use crate::sdo::{Bytes, Initiate, Multiplexer, Request, Response, Segment};

/// A download under way.
#[derive(Debug)]
pub struct Protocol<'a> {
    data: &'a [u8],
    /// Bytes that the server has acknowledged.
    done: usize,
    /// The segment that waits for its acknowledgement; `None` while the initiate request waits.
    segment: Option<Sent>,
}

#[derive(Clone, Copy, Debug)]
struct Sent {
    toggle: bool,
    last: bool,
    len: usize,
}

impl<'a> Download<'a> {
    /// Writes an object of a server.
    #[must_use]
    pub fn new(
        channel: impl Into<Channel>,
        at: Multiplexer,
        data: &'a [u8],
        options: Options,
    ) -> Download<'a> {
        Transfer::with(Protocol { data, done: 0, segment: None }, channel.into(), at, options)
    }
}

impl Protocol<'_> {
    fn is_expedited(&self) -> bool {
        matches!(self.data.len(), 1..=4)
    }

    fn send(&mut self, toggle: bool, link: &mut Link) {
        let rest = self.data.get(self.done..).unwrap_or(&[]);
        let data = Bytes::from_slice(rest);
        let segment = Segment { toggle, last: rest.len() <= 7, data };
        self.segment = Some(Sent { toggle, last: segment.last, len: data.len().into() });
        link.ask(Request::DownloadSegment(segment));
    }

    fn on_begun(&mut self, link: &mut Link) -> Progress {
        if self.is_expedited() {
            self.done = self.data.len();
            return Progress::Complete;
        }
        self.send(false, link);
        Progress::Continues
    }

    fn on_acknowledged(&mut self, sent: Sent, link: &mut Link) -> Progress {
        self.done = self.done.saturating_add(sent.len);
        if sent.last {
            return Progress::Complete;
        }
        self.send(!sent.toggle, link);
        Progress::Continues
    }
}

impl transfer::Protocol for Protocol<'_> {
    fn begin(&mut self, link: &mut Link) {
        (self.done, self.segment) = (0, None);
        let initiate = if self.is_expedited() {
            Initiate::Expedited(Bytes::from_slice(self.data))
        } else {
            Initiate::Segmented(u32::try_from(self.data.len()).ok())
        };
        link.begin(Request::Download(link.at, initiate));
    }

    fn on_response(&mut self, data: [u8; 8], link: &mut Link, _: Instant) -> Result<Progress, Error> {
        Ok(match (self.segment, Response::parse(data)) {
            (None, Some(Response::Downloaded(of))) if of == link.at => self.on_begun(link),
            (Some(sent), Some(Response::DownloadedSegment { toggle })) if toggle == sent.toggle => {
                self.on_acknowledged(sent, link)
            }
            _ => Progress::Unexpected,
        })
    }

    fn transferred(&self) -> usize {
        self.done
    }
}
