//! A server built from the protocol's messages, and a bus on which frames can be lost, doubled and changed.

use canopen::client::sdo::{Error, Options};
use canopen::client::{Service, Step};
use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request, Response, Segment,
};
use canopen::{Duration, Frame, Instant, NodeId};
use crc::{CRC_16_XMODEM, Crc};

pub(crate) const NODE: NodeId = NodeId::new(5).expect("a node-ID");
pub(crate) const OBJECT: Multiplexer = Multiplexer { index: 0x2000, sub: 3 };

/// A second for each answer, ten seconds in all, no retry.
pub(crate) fn once() -> Options {
    Options { retries: 0, ..Options::default() }
}

/// The device at the other end of the bus.
pub(crate) trait Device {
    /// The answers to a frame.
    fn answer(&mut self, request: [u8; 8]) -> Vec<[u8; 8]>;
}

impl<F: FnMut([u8; 8]) -> Vec<[u8; 8]>> Device for F {
    fn answer(&mut self, request: [u8; 8]) -> Vec<[u8; 8]> {
        self(request)
    }
}

/// Runs a service on a bus where a frame takes 100 us. Returns the outcome, the time of the end, and the frames sent.
pub(crate) fn run<S: Service>(service: &mut S, device: &mut impl Device) -> (S::Output, Instant, Vec<Frame>) {
    let (mut now, mut sent, mut answers) = (Instant(0), vec![], std::collections::VecDeque::new());
    loop {
        match service.next(now) {
            Step::Send(frame) => {
                now = now + Duration(100);
                answers.extend(device.answer(frame.data().try_into().unwrap()));
                sent.push(frame);
            }
            Step::Wait(until) => match answers.pop_front() {
                Some(data) => {
                    now = now + Duration(100);
                    service.on_frame(&Frame::new(0x585, &data).unwrap(), now);
                }
                None => now = until,
            },
            Step::Done(output) => return (output, now, sent),
        }
    }
}

/// A server with one object.
#[derive(Default)]
pub(crate) struct Server {
    pub(crate) value: Vec<u8>,
    /// The server does not indicate the size.
    pub(crate) is_sizeless: bool,
    /// Number of segments that the server asks for in a block of a download.
    pub(crate) block_size: u8,
    pub(crate) received: Vec<u8>,
    pub(crate) place: usize,
    pub(crate) toggle: bool,
    /// Number of segments received in this block.
    pub(crate) sequence: u8,
    pub(crate) is_in_block: bool,
    pub(crate) is_last: bool,
    /// Size of the blocks of an upload.
    pub(crate) size: u8,
}

pub(crate) fn crc(data: &[u8]) -> u16 {
    Crc::<u16>::new(&CRC_16_XMODEM).checksum(data)
}

impl Server {
    pub(crate) fn new(value: &[u8]) -> Server {
        Server { value: value.to_vec(), block_size: 4, ..Server::default() }
    }

    fn announced(&self) -> Option<u32> {
        u32::try_from(self.value.len()).ok().filter(|_| !self.is_sizeless)
    }

    fn upload_segment(&mut self, toggle: bool) -> Response {
        let rest = &self.value[self.place..];
        let data = Bytes::from_slice(rest);
        self.place += usize::from(data.len());
        Response::UploadedSegment(Segment { toggle, last: rest.len() <= 7, data })
    }

    fn block(&mut self) -> Vec<[u8; 8]> {
        let rest = &self.value[self.place..];
        let segments = rest.len().div_ceil(7).max(1);
        let segment = |number: u8| {
            let data = rest.get(7 * (usize::from(number) - 1)..).unwrap_or(&[]);
            let last = usize::from(number) == segments;
            let sequence = BlockSize::new(number).unwrap();
            BlockSegment { last, sequence, data: Bytes::from_slice(data).padded() }.encode()
        };
        (1..=self.size).filter(|&number| usize::from(number) <= segments).map(segment).collect()
    }

    fn take_segment(&mut self, segment: BlockSegment) -> Vec<[u8; 8]> {
        if segment.sequence.get() == self.sequence + 1 {
            self.sequence += 1;
            self.received.extend_from_slice(&segment.data);
            self.is_last = segment.last;
        }
        if !segment.last && segment.sequence.get() < self.block_size {
            return vec![];
        }
        let sequence = std::mem::take(&mut self.sequence);
        self.is_in_block = !self.is_last;
        vec![Response::BlockAcknowledge(sequence, BlockSize::new(self.block_size).unwrap()).encode()]
    }

    fn serve(&mut self, request: Request) -> Vec<Response> {
        match request {
            Request::Upload(at) if (1..=4).contains(&self.value.len()) => {
                vec![Response::Uploaded(at, Bytes::from_slice(&self.value))]
            }
            Request::Upload(at) => {
                self.place = 0;
                vec![Response::UploadSegmented(at, self.announced())]
            }
            Request::UploadSegment { toggle } => vec![self.upload_segment(toggle)],
            Request::Download(at, Initiate::Expedited(bytes)) => {
                self.value = bytes.as_slice().to_vec();
                vec![Response::Downloaded(at)]
            }
            Request::Download(at, _) => {
                (self.received, self.toggle) = (vec![], false);
                vec![Response::Downloaded(at)]
            }
            Request::DownloadSegment(segment) => {
                assert_eq!(segment.toggle, self.toggle);
                self.toggle = !self.toggle;
                self.received.extend_from_slice(segment.data.as_slice());
                if segment.last {
                    self.value = std::mem::take(&mut self.received);
                }
                vec![Response::DownloadedSegment { toggle: segment.toggle }]
            }
            Request::BlockDownload { at, .. } => {
                (self.received, self.sequence, self.is_in_block) = (vec![], 0, true);
                vec![Response::BlockDownload(at, BlockSize::new(self.block_size).unwrap())]
            }
            Request::BlockDownloadEnd(BlockEnd { unused, crc: of_client }) => {
                self.received.truncate(self.received.len() - usize::from(unused));
                assert_eq!(of_client, crc(&self.received));
                self.value = std::mem::take(&mut self.received);
                vec![Response::BlockDownloaded]
            }
            Request::BlockUpload { at, block_size, .. } => {
                (self.place, self.size) = (0, block_size);
                vec![Response::BlockUpload { at, crc: true, size: self.announced() }]
            }
            Request::Abort(..) => {
                self.is_in_block = false;
                vec![]
            }
            Request::BlockUploadStart | Request::BlockAcknowledge { .. } | Request::BlockUploadEnded => {
                vec![]
            }
        }
    }
}

impl Device for Server {
    fn answer(&mut self, request: [u8; 8]) -> Vec<[u8; 8]> {
        if let Some(segment) = BlockSegment::parse(request).filter(|_| self.is_in_block) {
            return self.take_segment(segment);
        }
        let request = Request::parse(&request).expect("a valid request");
        match request {
            Request::BlockUploadStart => self.block(),
            Request::BlockAcknowledge { sequence, block_size } => {
                self.place += 7 * usize::from(sequence);
                self.size = block_size;
                if self.place < self.value.len() {
                    return self.block();
                }
                vec![Response::BlockUploadEnd(BlockEnd::of(self.value.len(), crc(&self.value))).encode()]
            }
            request => self.serve(request).into_iter().map(Response::encode).collect(),
        }
    }
}

pub(crate) type Outcome = Result<(), Error>;
