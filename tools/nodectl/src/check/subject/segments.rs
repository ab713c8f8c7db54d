//! Transfers frame by frame, for situations that a normal client does not produce.

use canopen::sdo::{Bytes, Initiate, Request, Response, Segment};

use super::verdict::{Outcome, fail, skip};
use super::{Refusal, Subject};
use crate::object::at;

impl Subject<'_> {
    /// Sends a request and returns the decoded response.
    pub(in crate::check) fn respond(&mut self, request: Request) -> Outcome<Response> {
        let answer = self.answer(request.encode())?;
        Response::parse(answer)
            .ok_or_else(|| fail("an answer with a command specifier of CiA 301", format!("{answer:02X?}")))
    }

    /// Downloads in segments, also a short value.
    pub(in crate::check) fn segmented(
        &mut self,
        index: u16,
        sub: u8,
        value: &[u8],
        announced: bool,
    ) -> Outcome<std::result::Result<(), Refusal>> {
        let before = self.try_read(index, sub)?;
        self.written.extend(before.ok().map(|before| (at(index, sub), before)));
        let size = announced.then_some(u32::try_from(value.len()).unwrap_or(u32::MAX));
        match self.respond(Request::Download(at(index, sub), Initiate::Segmented(size)))? {
            Response::Downloaded(_) => (),
            Response::Abort(_, code) => return Ok(Err(Refusal(code))),
            other => return Err(fail("the response to the initiation of a download", format!("{other:X?}"))),
        }
        let pieces: Vec<&[u8]> = value.chunks(7).collect();
        for (number, piece) in pieces.iter().enumerate() {
            let toggle = number % 2 == 1;
            let data = Bytes::from_slice(piece);
            let segment = Segment { toggle, last: number + 1 == pieces.len(), data };
            match self.respond(Request::DownloadSegment(segment))? {
                Response::DownloadedSegment { toggle: answered } if answered == toggle => (),
                Response::Abort(_, code) => return Ok(Err(Refusal(code))),
                other => {
                    return Err(fail(
                        "the response to a segment, with its toggle bit",
                        format!("{other:X?}"),
                    ));
                }
            }
        }
        Ok(Ok(()))
    }

    /// Begins an upload in segments. Returns the size that the device announces. Skipped where the upload is not
    /// segmented.
    pub(in crate::check) fn begin_segmented_upload(&mut self, index: u16, sub: u8) -> Outcome<Option<u32>> {
        match self.respond(Request::Upload(at(index, sub)))? {
            Response::UploadSegmented(_, size) => Ok(size),
            Response::Uploaded(..) => Err(skip("the value is short enough for one frame")),
            other => Err(fail("the response to the initiation of an upload", format!("{other:X?}"))),
        }
    }

    /// Uploads in segments. Returns all segments as they came.
    pub(in crate::check) fn segments(&mut self) -> Outcome<Vec<Segment>> {
        let mut segments: Vec<Segment> = Vec::new();
        while segments.last().is_none_or(|segment| !segment.last) {
            let toggle = segments.len() % 2 == 1;
            match self.respond(Request::UploadSegment { toggle })? {
                Response::UploadedSegment(segment) if segments.len() < 10_000 => segments.push(segment),
                other => return Err(fail("a segment", format!("{other:X?}"))),
            }
        }
        Ok(segments)
    }

    /// Aborts a transfer, so that the next transfer starts afresh.
    pub(in crate::check) fn give_up(&mut self, index: u16, sub: u8) -> Outcome {
        let request = Request::Abort(at(index, sub), 0x0800_0000).encode();
        self.send(0x600 + self.id(), &request)?;
        self.pass(10)
    }
}
