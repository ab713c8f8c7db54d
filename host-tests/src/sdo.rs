//! The SDO client of crate `canopen` for tests, over any channel that carries frames to one server and back.
//!
//! The client is stricter than a client in the field: it tries once, and any unexpected frame ends the transfer, except
//! for a frame that the bus has repeated (after a lost acknowledge).

use canopen::client::sdo::{BlockDownload, BlockUpload, Buffer, Download, Error, Options, Upload};
use canopen::client::{Service, Step, Taken};
use canopen::sdo::{BlockSize, Multiplexer};
use canopen::{Duration, Frame, Instant, NodeId};

/// A channel to an SDO server and back.
pub trait Channel {
    /// Sends a request.
    fn send(&mut self, request: [u8; 8]);

    /// The oldest response that has arrived.
    fn received(&mut self) -> Option<[u8; 8]>;

    /// Waits for the next response; `None` when none arrives within the time-out of the client.
    fn wait(&mut self) -> Option<[u8; 8]>;
}

/// The reason why a transfer failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Failure {
    /// The server gave up, with this abort code.
    Refused(u32),
    /// There was no response.
    Silence,
    /// The response does not fit the request.
    Unexpected([u8; 8]),
    /// The data does not match the CRC or the size at the end of an upload.
    Corrupt,
}

/// The client of one server.
#[derive(Debug)]
pub struct Client<'a, C> {
    channel: &'a mut C,
}

/// Buffer size: no object of a test is larger.
const MEMORY: usize = 1 << 20;
/// The channel addresses the server; the client needs any node-ID.
const NODE: NodeId = NodeId::new(1).expect("a node-ID");
/// The channel has the time-out, so the client's own time does not advance while it waits for the channel.
const OPTIONS: Options = Options {
    timeout: Duration::from_millis(1000),
    limit: Duration(u64::MAX),
    retries: 0,
    block_size: BlockSize::MAX,
};

impl<'a, C: Channel> Client<'a, C> {
    /// A client that uses this channel.
    pub fn new(channel: &'a mut C) -> Client<'a, C> {
        Client { channel }
    }

    /// Reads a value, by expedited or segmented transfer as the server chooses.
    ///
    /// # Errors
    /// The reason of the failure.
    pub fn read(&mut self, at: Multiplexer) -> Result<Vec<u8>, Failure> {
        let mut memory = vec![0; MEMORY];
        let mut upload = Upload::new(NODE, at, Buffer::new(&mut memory), OPTIONS);
        self.run(&mut upload)?;
        Ok(upload.into_sink().as_slice().to_vec())
    }

    /// Writes a value: up to four bytes expedited, more in segments.
    ///
    /// # Errors
    /// The reason of the failure.
    pub fn write(&mut self, at: Multiplexer, value: &[u8]) -> Result<(), Failure> {
        self.run(&mut Download::new(NODE, at, value, OPTIONS))
    }

    /// Reads a value by block transfer with `block_size` segments per block (1 to 127) and checks its CRC.
    ///
    /// # Errors
    /// The reason of the failure.
    ///
    /// # Panics
    /// With another block size.
    pub fn read_blocks(&mut self, at: Multiplexer, block_size: u8) -> Result<Vec<u8>, Failure> {
        let block_size = BlockSize::new(block_size).expect("1 to 127 segments");
        let mut memory = vec![0; MEMORY];
        let options = Options { block_size, ..OPTIONS };
        let mut upload = BlockUpload::new(NODE, at, Buffer::new(&mut memory), options);
        self.run(&mut upload)?;
        Ok(upload.into_sink().as_slice().to_vec())
    }

    /// Writes a value by block transfer with the server's block size and a CRC.
    ///
    /// # Errors
    /// The reason of the failure.
    pub fn write_blocks(&mut self, at: Multiplexer, value: &[u8]) -> Result<(), Failure> {
        self.run(&mut BlockDownload::new(NODE, at, value, OPTIONS))
    }

    /// Aborts a transfer.
    pub fn abort(&mut self, at: Multiplexer) {
        let mut transfer = Download::new(NODE, at, &[], OPTIONS);
        transfer.abort();
        // The result is always "cancelled".
        let _ = self.run(&mut transfer);
    }

    /// Runs a transfer; frames that have arrived before it are discarded.
    fn run(&mut self, service: &mut impl Service<Output = Result<(), Error>>) -> Result<(), Failure> {
        while self.channel.received().is_some() {}
        let mut now = Instant(0);
        loop {
            match service.next(now) {
                Step::Send(frame) => {
                    while let Some(response) = self.channel.received() {
                        offer(service, response, now)?;
                    }
                    self.channel.send(frame.data().try_into().expect("eight bytes"));
                }
                Step::Wait(until) => match self.channel.wait() {
                    Some(response) => offer(service, response, now)?,
                    None => now = until,
                },
                Step::Done(result) => return result.map_err(failure),
            }
        }
    }
}

fn offer(service: &mut impl Service, response: [u8; 8], now: Instant) -> Result<(), Failure> {
    let frame = Frame::new(0x580 + u16::from(NODE.get()), &response).expect("a frame");
    let taken = service.on_frame(&frame, now);
    if taken == Taken::Unexpected { Err(Failure::Unexpected(response)) } else { Ok(()) }
}

fn failure(error: Error) -> Failure {
    match error {
        Error::Abort(code) => Failure::Refused(code.0),
        Error::NoAnswer | Error::Late | Error::Cancelled => Failure::Silence,
        Error::Unexpected | Error::Crc | Error::TooLong => Failure::Corrupt,
    }
}
