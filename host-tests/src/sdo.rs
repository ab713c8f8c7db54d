//! An SDO client for tests (CiA 301, 7.2.4): all transfers, over whatever carries frames to one server and back.
//!
//! It allows for frames that the bus repeats (a lost acknowledge), and for nothing else: any other frame that is not
//! the next one of the transfer is a failure.

use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment,
};
use crc::{CRC_16_XMODEM, Crc};

/// What carries frames to an SDO server and back.
pub trait Channel {
    /// Sends a request.
    fn send(&mut self, request: [u8; 8]);

    /// The oldest response that has come by now.
    fn received(&mut self) -> Option<[u8; 8]>;

    /// The next response; `None` when none comes within the time-out of the client.
    fn wait(&mut self) -> Option<[u8; 8]>;
}

/// Why a transfer came to nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The server gave up, with this abort code.
    Refused(u32),
    /// There was no response.
    Silence,
    /// This is not the response to the request.
    Unexpected([u8; 8]),
    /// The data does not match the CRC or the size at the end of a block upload.
    Corrupt,
}

/// The client of one server.
#[derive(Debug)]
pub struct Client<'a, C> {
    channel: &'a mut C,
    /// The last response. When it comes again, the bus has repeated it.
    last: Option<[u8; 8]>,
}

impl<'a, C: Channel> Client<'a, C> {
    /// A client that uses this channel.
    pub fn new(channel: &'a mut C) -> Client<'a, C> {
        Client { channel, last: None }
    }

    /// Reads a value, by whichever of the two simple transfers the server chooses.
    ///
    /// # Errors
    /// Why it failed.
    pub fn read(&mut self, at: Multiplexer) -> Result<Vec<u8>, Failure> {
        self.begin();
        let size = match self.exchange(Request::Upload(at))? {
            Response::Uploaded(of, bytes) if of == at => return Ok(bytes.as_slice().to_vec()),
            Response::UploadSegmented(of, Some(size)) if of == at => size,
            other => return Err(unexpected(other)),
        };
        let mut value = vec![];
        for toggle in [false, true].into_iter().cycle() {
            let segment = match self.exchange(Request::UploadSegment { toggle })? {
                Response::UploadedSegment(segment) if segment.toggle == toggle => segment,
                other => return Err(unexpected(other)),
            };
            value.extend_from_slice(segment.data.as_slice());
            if segment.last {
                break;
            }
        }
        if value.len() == size as usize { Ok(value) } else { Err(Failure::Corrupt) }
    }

    /// Writes a value: up to four bytes at once, more in segments.
    ///
    /// # Errors
    /// Why it failed.
    pub fn write(&mut self, at: Multiplexer, value: &[u8]) -> Result<(), Failure> {
        self.begin();
        let initiate = match value.len() {
            ..=4 => Initiate::Expedited(Bytes::from_slice(value)),
            len => Initiate::Segmented(u32::try_from(len).ok()),
        };
        self.expect(Request::Download(at, initiate), Response::Downloaded(at))?;
        if value.len() <= 4 { Ok(()) } else { self.write_segments(value) }
    }

    fn write_segments(&mut self, value: &[u8]) -> Result<(), Failure> {
        let mut segments = value.chunks(7).zip([false, true].into_iter().cycle()).peekable();
        while let Some((data, toggle)) = segments.next() {
            let last = segments.peek().is_none();
            let segment = Segment { toggle, last, data: Bytes::from_slice(data) };
            self.expect(Request::DownloadSegment(segment), Response::DownloadedSegment { toggle })?;
        }
        Ok(())
    }

    /// Reads a value in blocks of so many segments (1 to 127) and checks its CRC.
    ///
    /// # Errors
    /// Why it failed.
    pub fn read_blocks(&mut self, at: Multiplexer, block_size: u8) -> Result<Vec<u8>, Failure> {
        self.begin();
        let size = match self.exchange(Request::BlockUpload { at, crc: true, block_size, threshold: 0 })? {
            Response::BlockUpload { at: of, crc: true, size: Some(size) } if of == at => size as usize,
            other => return Err(unexpected(other)),
        };
        self.send(Request::BlockUploadStart);
        let mut value = vec![];
        while value.len() < size {
            let sequence = self.receive_block(block_size, &mut value)?;
            self.send(Request::BlockAcknowledge { sequence, block_size });
        }
        let end = match self.response()? {
            Response::BlockUploadEnd(end) => end,
            other => return Err(unexpected(other)),
        };
        self.send(Request::BlockUploadEnded);
        value.truncate(value.len() - usize::from(end.unused));
        if value.len() == size && end == end_of(&value) { Ok(value) } else { Err(Failure::Corrupt) }
    }

    /// Takes the segments of one block that come in sequence, and gives the number of the last of them. A block whose
    /// end is lost is over after the time-out.
    fn receive_block(&mut self, block_size: u8, value: &mut Vec<u8>) -> Result<u8, Failure> {
        let mut sequence = 0;
        loop {
            let frame = match self.frame() {
                Err(Failure::Silence) if sequence > 0 => return Ok(sequence),
                frame => frame?,
            };
            let segment = BlockSegment::parse(frame).ok_or(Failure::Unexpected(frame))?;
            if segment.sequence.get() == sequence + 1 {
                sequence += 1;
                value.extend_from_slice(&segment.data);
            }
            if segment.last || segment.sequence.get() == block_size {
                return Ok(sequence);
            }
        }
    }

    /// Writes a value in blocks of the size that the server wants, with a CRC.
    ///
    /// # Errors
    /// Why it failed.
    pub fn write_blocks(&mut self, at: Multiplexer, value: &[u8]) -> Result<(), Failure> {
        self.begin();
        let size = u32::try_from(value.len()).ok();
        let mut block_size = match self.exchange(Request::BlockDownload { at, crc: true, size })? {
            Response::BlockDownload(of, block_size) if of == at => block_size,
            other => return Err(unexpected(other)),
        };
        let segments: Vec<&[u8]> = value.chunks(7).collect();
        let mut done = 0;
        while done < segments.len() {
            let sequence;
            (sequence, block_size) = self.send_block(&segments[done..], block_size)?;
            done += usize::from(sequence);
        }
        self.expect(Request::BlockDownloadEnd(end_of(value)), Response::BlockDownloaded)
    }

    /// Sends a block and gives its acknowledgement.
    fn send_block(&mut self, segments: &[&[u8]], size: BlockSize) -> Result<(u8, BlockSize), Failure> {
        let block = (1..=size.get()).zip(segments);
        for (number, data) in block {
            let sequence = BlockSize::new(number).ok_or(Failure::Corrupt)?;
            let last = usize::from(number) == segments.len();
            let data = Bytes::from_slice(data).padded();
            self.forget_repeated()?;
            self.channel.send(BlockSegment { last, sequence, data }.encode());
        }
        // Two blocks of the same size have the same acknowledgement.
        self.last = None;
        match self.response()? {
            Response::BlockAcknowledge(sequence, size) => Ok((sequence, size)),
            other => Err(unexpected(other)),
        }
    }

    /// Gives a transfer up.
    pub fn abort(&mut self, at: Multiplexer) {
        self.send(Request::Abort(at, 0x0800_0000));
    }

    /// A new transfer: what has come late belongs to none.
    fn begin(&mut self) {
        while self.channel.received().is_some() {}
        self.last = None;
    }

    /// Within a block the server says nothing, unless it gives up or the bus repeats its last response.
    fn forget_repeated(&mut self) -> Result<(), Failure> {
        while let Some(frame) = self.channel.received() {
            if let Some(code) = abort_code(frame) {
                return Err(Failure::Refused(code));
            }
            if self.last != Some(frame) {
                return Err(Failure::Unexpected(frame));
            }
        }
        Ok(())
    }

    fn send(&mut self, request: Request) {
        self.channel.send(request.encode());
    }

    /// The next frame that is not repeated and no abort.
    fn frame(&mut self) -> Result<[u8; 8], Failure> {
        loop {
            let frame = self.channel.wait().ok_or(Failure::Silence)?;
            if let Some(code) = abort_code(frame) {
                return Err(Failure::Refused(code));
            }
            if self.last.replace(frame) != Some(frame) {
                return Ok(frame);
            }
        }
    }

    fn response(&mut self) -> Result<Response, Failure> {
        let frame = self.frame()?;
        Response::parse(frame).ok_or(Failure::Unexpected(frame))
    }

    fn exchange(&mut self, request: Request) -> Result<Response, Failure> {
        self.send(request);
        self.response()
    }

    fn expect(&mut self, request: Request, expected: Response) -> Result<(), Failure> {
        let response = self.exchange(request)?;
        if response == expected { Ok(()) } else { Err(unexpected(response)) }
    }
}

/// The segments of a block have the first byte of an abort too, but for their sequence number, which is never 0.
fn abort_code(frame: [u8; 8]) -> Option<u32> {
    match Response::parse(frame)? {
        Response::Abort(_, code) if frame[0] == 0x80 => Some(code),
        _ => None,
    }
}

fn unexpected(response: Response) -> Failure {
    Failure::Unexpected(response.encode())
}

/// The end of a block transfer of this value.
fn end_of(value: &[u8]) -> BlockEnd {
    let crc = Crc::<u16>::new(&CRC_16_XMODEM).checksum(value);
    let tail = value.chunks(7).next_back().map_or(7, <[u8]>::len);
    BlockEnd { unused: u8::try_from(7 - tail).unwrap_or(0), crc }
}
