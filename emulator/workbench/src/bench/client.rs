//! The SDO client at the other end of the bus. The client adds up the instructions that its requests take in the node,
//! and rejects a wrong answer.

use anyhow::{Context, Result, bail, ensure};
use canopen::client::sdo::{BlockDownload, BlockUpload, Buffer, Download, Error, Options, Upload};
use canopen::client::{Service, Step, Taken};
use canopen::sdo::{BlockSize, Multiplexer};
use canopen::{Duration, Frame, Instant, NodeId};
use emulator::Visits;

use crate::bench::mailbox::{Command, Request};
use crate::bench::program::Program;

/// The node-ID of every program.
const ID: u16 = 1;
const NODE: NodeId = NodeId::new(1).expect("a node-ID");
/// Bytes for an uploaded value: no object of the programs is larger.
const MEMORY: usize = 1024;
/// Every transfer is tried once.
const OPTIONS: Options = Options {
    timeout: Duration::from_millis(1000),
    limit: Duration::from_millis(10_000),
    retries: 0,
    block_size: BlockSize::MAX,
};

/// A program with its virtual time and the count of its instructions.
pub(crate) struct Client {
    program: Program,
    now: u64,
    spent: u64,
}

impl Client {
    pub(crate) fn new(program: Program) -> Client {
        Client { program, now: 0, spent: 0 }
    }

    /// Instructions counted since the last call.
    pub(crate) fn take_spent(&mut self) -> u64 {
        std::mem::take(&mut self.spent)
    }

    /// Visits of each block of instructions since the last call.
    pub(crate) fn take_profile(&mut self) -> Vec<Visits> {
        self.program.take_profile()
    }

    fn run(&mut self, request: Request) -> Result<Vec<Frame>> {
        let outcome = self.program.run(request)?;
        self.spent += outcome.instructions;
        Ok(outcome.frames)
    }

    /// One pass of the node, `later` microseconds after the last request.
    pub(crate) fn pass(&mut self, later: u64) -> Result<Vec<Frame>> {
        self.now += later;
        self.run(Request { command: Command::Pass, now: self.now, frame: None })
    }

    fn send(&mut self, command: Command, id: u16, data: &[u8]) -> Result<Vec<Frame>> {
        let frame = Some(Frame::new(id, data).context("a frame has eight bytes")?);
        self.run(Request { command, now: self.now, frame })
    }

    /// A frame with an identifier that the node does not use.
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

    /// A transfer, from its first request to its last. The node answers at once or not at all.
    fn transfer<S: Service<Output = Result<(), Error>>>(
        &mut self,
        service: &mut S,
    ) -> Result<Result<(), Error>> {
        loop {
            match service.next(Instant(self.now)) {
                Step::Send(request) => self.exchange(service, &request)?,
                // The node answers in the same run: when no answer has come, none will come.
                Step::Wait(_) => return Ok(Err(Error::NoAnswer)),
                Step::Done(result) => return Ok(result),
            }
        }
    }

    /// Sends one frame to the node and passes the answers of the node to the client.
    fn exchange(&mut self, service: &mut impl Service, request: &Frame) -> Result<()> {
        for answer in self.send(Command::Serve, request.id(), request.data())? {
            let taken = service.on_frame(&answer, Instant(self.now));
            ensure!(taken != Taken::Unexpected, "{answer:?} is no answer to {request:?}");
        }
        Ok(())
    }

    /// Reads a value; the inner error is the abort code.
    pub(crate) fn read(&mut self, at: Multiplexer) -> Result<Result<Vec<u8>, u32>> {
        let mut memory = [0; MEMORY];
        let mut upload = Upload::new(NODE, at, Buffer::new(&mut memory), OPTIONS);
        match self.transfer(&mut upload)? {
            Ok(()) => Ok(Ok(upload.into_sink().as_slice().to_vec())),
            Err(Error::Abort(code)) => Ok(Err(code.0)),
            Err(error) => bail!("{at:?}: {error}"),
        }
    }

    pub(crate) fn write(&mut self, at: Multiplexer, value: &[u8]) -> Result<()> {
        Ok(self.transfer(&mut Download::new(NODE, at, value, OPTIONS))??)
    }

    pub(crate) fn write_block(&mut self, at: Multiplexer, data: &[u8]) -> Result<()> {
        Ok(self.transfer(&mut BlockDownload::new(NODE, at, data, OPTIONS))??)
    }

    pub(crate) fn read_block(&mut self, at: Multiplexer) -> Result<Vec<u8>> {
        let mut memory = [0; MEMORY];
        let mut upload = BlockUpload::new(NODE, at, Buffer::new(&mut memory), OPTIONS);
        self.transfer(&mut upload)??;
        Ok(upload.into_sink().as_slice().to_vec())
    }
}
