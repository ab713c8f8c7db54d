//! The client of one node.

use canopen::client::Service;
use canopen::client::sdo::{self, BlockDownload, BlockUpload, Download, SEGMENT_TIME, Upload};
use canopen::sdo::Multiplexer;
use canopen::{Duration, Instant, NodeId};

use super::channel::Via;
use super::command::Command;
use super::memory::Memory;
use super::{Cause, Error, Options};
use crate::network::Network;

/// How often an object is read whose transfers the server drops for those of another client.
const TRIES: u64 = 4;

/// The SDO client of one node.
pub struct Client<'n> {
    network: &'n mut Network,
    node: NodeId,
    options: Options,
    deadline: Instant,
}

impl<'n> Client<'n> {
    /// The client of a node.
    pub fn new(network: &'n mut Network, node: NodeId, options: Options) -> Client<'n> {
        Client { network, node, options, deadline: Instant::NEVER }
    }

    /// The client with a common deadline for several transfers, in [`Network::own_time`], besides the time limit of each
    /// transfer.
    #[must_use]
    pub fn by(self, deadline: Instant) -> Client<'n> {
        Client { deadline, ..self }
    }

    /// Reads an object, expedited or segmented as the server chooses.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn upload(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        let mut tries = 0;
        loop {
            let begin = self.network.now();
            let error = match self.upload_once(at) {
                Ok(bytes) => return Ok(bytes),
                Err(error) => error,
            };
            // Another client has asked in the same moment, and the server has dropped this transfer for the other one. Its
            // abort is no answer to this request.
            if !(error.may_be_dropped() && self.network.has_other_request_since(self.node, begin)) {
                return Err(error);
            }
            tries += 1;
            if tries == TRIES {
                return Err(Error { cause: Cause::Busy, ..error });
            }
            let pause = Duration(turn().0 * tries);
            self.network.pause(pause).map_err(|bus| Error { cause: bus.into(), ..error })?;
        }
    }

    fn upload_once(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        let node = self.node;
        let upload = self.run(
            at,
            self.options(),
            |options| Upload::new(node, at, Memory::default(), options),
            |_| (),
        )?;
        Ok(upload.into_sink().0)
    }

    /// Writes an object: up to four bytes expedited, else segmented. `progress` is called with the bytes that have
    /// arrived.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn download(
        &mut self,
        at: Multiplexer,
        value: &[u8],
        progress: impl FnMut(usize),
    ) -> Result<(), Error> {
        let mut progress = news(progress);
        let node = self.node;
        let begin = |options| Download::new(node, at, value, options);
        self.run(at, self.patience(value), begin, |download| progress(download.transferred())).map(drop)
    }

    /// Writes one byte that the server need not acknowledge, because it restarts its node. The request is sent once, and a
    /// missing answer is no error.
    ///
    /// # Errors
    /// The node refuses, the bus is lost, or another client uses the server all the time.
    pub fn command(&mut self, at: Multiplexer, value: u8) -> Result<(), Error> {
        let node = self.node;
        let begin = |options: Options| Command::new(node, at, value, options.timeout);
        self.run(at, self.options(), begin, |_| ()).map(drop)
    }

    /// Reads an object in blocks.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn block_upload(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        let node = self.node;
        let begin = |options| BlockUpload::new(node, at, Memory::default(), options);
        let upload = self.run(at, self.options(), begin, |_| ())?;
        Ok(upload.into_sink().0)
    }

    /// Writes an object in blocks. `progress` is called with the bytes that have arrived.
    ///
    /// An empty value is written segmented, because not every server accepts a block without data.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn block_download(
        &mut self,
        at: Multiplexer,
        value: &[u8],
        progress: impl FnMut(usize),
    ) -> Result<(), Error> {
        if value.is_empty() {
            return self.download(at, value, progress);
        }
        let mut progress = news(progress);
        let node = self.node;
        let begin = |options| BlockDownload::new(node, at, value, options);
        self.run(at, self.patience(value), begin, |download| progress(download.transferred())).map(drop)
    }

    /// Extends the time limit for a long value, by the time of one frame and its answer per segment on the slowest bus.
    fn patience(&self, value: &[u8]) -> Options {
        let segments = u64::try_from(value.len() / 7).unwrap_or(u64::MAX);
        let options = self.options();
        let limit = Duration(options.limit.0.saturating_add(segments.saturating_mul(SEGMENT_TIME.0)));
        Options { limit, ..options }
    }

    fn options(&self) -> Options {
        let left = self.deadline.0.saturating_sub(self.network.own_time().0);
        Options { limit: Duration(self.options.limit.0.min(left)), ..self.options }
    }

    /// Runs a transfer, and begins it again as often as the options allow. Each attempt waits for its turn.
    fn run<S>(
        &mut self,
        at: Multiplexer,
        options: Options,
        mut begin: impl FnMut(Options) -> S,
        mut progress: impl FnMut(&S),
    ) -> Result<S, Error>
    where
        S: Service<Output = Result<(), sdo::Error>>,
    {
        let end = self.network.own_time() + options.limit;
        let mut retries = options.retries;
        let cause = loop {
            let left = Duration(end.0.saturating_sub(self.network.own_time().0));
            let mut service = begin(Options { retries: 0, limit: left, ..options });
            match self.in_turn(left, &mut service, &mut progress) {
                Ok(()) => return Ok(service),
                Err(Cause::Transfer(error)) if retries > 0 && error.is_worth_a_retry() => retries -= 1,
                Err(cause) => break cause,
            }
        };
        if matches!(cause, Cause::Transfer(sdo::Error::NoAnswer)) {
            // The additional server may have been switched off; the default one is always there.
            self.network.set_channel(self.node, None);
        }
        Err(Error { node: self.node, at, name: None, hint: None, cause })
    }

    /// Runs a transfer when no transfer of another client runs.
    fn in_turn<S>(
        &mut self,
        limit: Duration,
        service: &mut S,
        mut progress: impl FnMut(&S),
    ) -> Result<(), Cause>
    where
        S: Service<Output = Result<(), sdo::Error>>,
    {
        let node = self.node;
        self.network.pass()?;
        let deadline = self.network.now() + limit;
        if !self.network.wait_for_turn(node, deadline)? {
            return Err(Cause::Busy);
        }
        let channel = self.network.channel(node);
        let mut via = Via { service, node, channel };
        Ok(self.network.run_with(&mut via, |via| progress(via.service))??)
    }
}

/// The pause before the second try; later pauses are longer. It differs between processes, so that two of them do not ask in one moment again.
fn turn() -> Duration {
    Duration::from_millis(u64::from(std::process::id() % 16) * 5)
}

/// Calls `tell` only when the number has changed.
fn news(mut tell: impl FnMut(usize)) -> impl FnMut(usize) {
    let mut told = 0;
    move |done| {
        if std::mem::replace(&mut told, done) != done {
            tell(done);
        }
    }
}
