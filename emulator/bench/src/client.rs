//! The client at the other end of the bus. It adds up what its requests cost the node, and does not take a wrong answer.

use anyhow::{Context, Result, bail, ensure};
use canopen::Frame;
use canopen::sdo::{
    BlockEnd, BlockSegment, BlockSize, Bytes, Initiate, Multiplexer, Request as Sdo, Response, Segment,
};
use crc::{CRC_16_XMODEM, Crc};
use emulator::Visits;

use crate::mailbox::{Command, Request};
use crate::program::Program;

/// The node-ID of every program.
const ID: u16 = 1;

/// A program, the time, and the count.
pub(crate) struct Client {
    program: Program,
    now: u64,
    spent: u64,
}

impl Client {
    pub(crate) fn new(program: Program) -> Client {
        Client { program, now: 0, spent: 0 }
    }

    /// The count since the last call.
    pub(crate) fn take_spent(&mut self) -> u64 {
        std::mem::take(&mut self.spent)
    }

    /// Where the instructions are since the last call.
    pub(crate) fn take_profile(&mut self) -> Vec<Visits> {
        self.program.take_profile()
    }

    fn run(&mut self, request: Request) -> Result<Vec<Frame>> {
        let outcome = self.program.run(request)?;
        self.spent += outcome.instructions;
        Ok(outcome.frames)
    }

    /// One pass of the node so many microseconds later.
    pub(crate) fn pass(&mut self, later: u64) -> Result<Vec<Frame>> {
        self.now += later;
        self.run(Request { command: Command::Pass, now: self.now, frame: None })
    }

    fn send(&mut self, command: Command, id: u16, data: &[u8]) -> Result<Vec<Frame>> {
        let frame = Some(Frame::new(id, data).context("a frame has eight bytes")?);
        self.run(Request { command, now: self.now, frame })
    }

    /// A frame of somebody else's.
    pub(crate) fn foreign(&mut self) -> Result<Vec<Frame>> {
        self.send(Command::Sort, 0x5A5, &[1, 2, 3, 4, 5, 6, 7, 8])
    }

    pub(crate) fn nmt(&mut self, command: u8) -> Result<Vec<Frame>> {
        self.send(Command::Process, 0, &[command, ID as u8])
    }

    pub(crate) fn sync(&mut self) -> Result<Vec<Frame>> {
        self.send(Command::Process, 0x80, &[])
    }

    pub(crate) fn rpdo(&mut self, data: [u8; 8]) -> Result<Vec<Frame>> {
        self.send(Command::Process, 0x200 + ID, &data)
    }

    /// One SDO frame to the node and all that it answers.
    fn sdo(&mut self, data: [u8; 8]) -> Result<Vec<[u8; 8]>> {
        let frames = self.send(Command::Serve, 0x600 + ID, &data)?;
        let answers = frames.iter().filter(|frame| frame.id() == 0x580 + ID);
        answers.map(|frame| frame.data().try_into().context("an SDO has eight bytes")).collect()
    }

    fn ask(&mut self, request: Sdo) -> Result<Response> {
        match self.sdo(request.encode())?[..] {
            [answer] => Response::parse(answer).context("no valid response"),
            ref answers => bail!("{} answers to {request:?}", answers.len()),
        }
    }

    /// Reads a value of up to four bytes; the abort code where there is none.
    pub(crate) fn read(&mut self, at: Multiplexer) -> Result<Result<Vec<u8>, u32>> {
        match self.ask(Sdo::Upload(at))? {
            Response::Uploaded(_, bytes) => Ok(Ok(bytes.as_slice().to_vec())),
            Response::Abort(_, code) => Ok(Err(code)),
            other => bail!("{other:?}"),
        }
    }

    pub(crate) fn write(&mut self, at: Multiplexer, value: &[u8]) -> Result<()> {
        let answer = self.ask(Sdo::Download(at, Initiate::Expedited(Bytes::from_slice(value))))?;
        ensure!(matches!(answer, Response::Downloaded(_)), "{at:?}: {answer:?}");
        Ok(())
    }

    pub(crate) fn read_segmented(&mut self, at: Multiplexer) -> Result<Vec<u8>> {
        let answer = self.ask(Sdo::Upload(at))?;
        ensure!(matches!(answer, Response::UploadSegmented(..)), "{answer:?}");
        let mut value = vec![];
        for toggle in [false, true].into_iter().cycle() {
            let answer = self.ask(Sdo::UploadSegment { toggle })?;
            let Response::UploadedSegment(Segment { last, data, .. }) = answer else { bail!("{answer:?}") };
            value.extend_from_slice(data.as_slice());
            if last {
                break;
            }
        }
        Ok(value)
    }

    /// A block download of at most one block.
    pub(crate) fn write_block(&mut self, at: Multiplexer, data: &[u8]) -> Result<()> {
        let size = Some(u32::try_from(data.len())?);
        let answer = self.ask(Sdo::BlockDownload { at, crc: true, size })?;
        ensure!(matches!(answer, Response::BlockDownload(_, BlockSize::MAX)), "{answer:?}");
        let last = data.len().div_ceil(7);
        let mut answers = vec![];
        for (number, chunk) in (1..).zip(data.chunks(7)) {
            answers = self.sdo(segment(number, number == last, chunk)?.encode())?;
        }
        let answer = answers.first().and_then(|answer| Response::parse(*answer));
        ensure!(matches!(answer, Some(Response::BlockAcknowledge(127, _))), "{answer:?}");
        let answer = self.ask(Sdo::BlockDownloadEnd(BlockEnd::of(data.len(), crc(data))))?;
        ensure!(answer == Response::BlockDownloaded, "{answer:?}");
        Ok(())
    }

    /// A block upload of at most one block.
    pub(crate) fn read_block(&mut self, at: Multiplexer) -> Result<Vec<u8>> {
        let request = Sdo::BlockUpload { at, crc: true, block_size: BlockSize::MAX.get(), threshold: 0 };
        let answer = self.ask(request)?;
        ensure!(matches!(answer, Response::BlockUpload { crc: true, .. }), "{answer:?}");
        let segments = self.sdo(Sdo::BlockUploadStart.encode())?;
        let mut data: Vec<u8> = segments.iter().flat_map(|segment| segment[1..].to_vec()).collect();
        let sequence = u8::try_from(segments.len())?;
        let answer = self.ask(Sdo::BlockAcknowledge { sequence, block_size: BlockSize::MAX.get() })?;
        let Response::BlockUploadEnd(end) = answer else { bail!("{answer:?}") };
        // zencan-node says 7 of a last segment that is full.
        data.truncate(data.len() - usize::from(end.unused % 7));
        ensure!(end.crc == crc(&data), "the CRC is wrong");
        // CiA 301 has no answer to it; zencan-node refuses it, with all the data delivered.
        self.sdo(Sdo::BlockUploadEnded.encode())?;
        Ok(data)
    }
}

fn segment(number: usize, last: bool, chunk: &[u8]) -> Result<BlockSegment> {
    let mut data = [0; 7];
    data[..chunk.len()].copy_from_slice(chunk);
    let sequence = BlockSize::new(u8::try_from(number)?).context("a block has 127 segments")?;
    Ok(BlockSegment { last, sequence, data })
}

fn crc(data: &[u8]) -> u16 {
    Crc::<u16>::new(&CRC_16_XMODEM).checksum(data)
}
