//! The client of one node.

use canopen::sdo::Multiplexer;
use canopen::{Duration, NodeId};

use super::channel::Channel;
use super::{Cause, Error, block_download, block_upload, segmented};
use crate::network::Network;

/// How patient a client is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// How long the server may take to answer a request.
    pub timeout: Duration,
    /// How often a transfer that got no answer, or one that does not fit, is begun anew.
    pub retries: u8,
}

impl Default for Options {
    /// A second, and one retry.
    fn default() -> Options {
        Options { timeout: Duration::from_millis(1000), retries: 1 }
    }
}

/// The SDO client of one node.
pub struct Client<'n> {
    network: &'n mut Network,
    node: NodeId,
    options: Options,
}

impl<'n> Client<'n> {
    /// The client of a node.
    pub fn new(network: &'n mut Network, node: NodeId, options: Options) -> Client<'n> {
        Client { network, node, options }
    }

    /// Reads an object, expedited or segmented as the server likes.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn upload(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        self.transfer(at, |channel| segmented::upload(channel, at))
    }

    /// Writes an object: up to four bytes expedited, else segmented. `progress` is told the bytes that have arrived.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn download(
        &mut self,
        at: Multiplexer,
        value: &[u8],
        mut progress: impl FnMut(usize),
    ) -> Result<(), Error> {
        self.transfer(at, |channel| segmented::download(channel, at, value, &mut progress))
    }

    /// Reads an object in blocks.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn block_upload(&mut self, at: Multiplexer) -> Result<Vec<u8>, Error> {
        self.transfer(at, |channel| block_upload::upload(channel, at))
    }

    /// Writes an object in blocks. `progress` is told the bytes that have arrived.
    ///
    /// No bytes at all go out segmented: a block has at least one.
    ///
    /// # Errors
    /// The node, the object and the reason.
    pub fn block_download(
        &mut self,
        at: Multiplexer,
        value: &[u8],
        mut progress: impl FnMut(usize),
    ) -> Result<(), Error> {
        if value.is_empty() {
            return self.download(at, value, progress);
        }
        self.transfer(at, |channel| block_download::download(channel, at, value, &mut progress))
    }

    /// Does a transfer, again when there was no answer, and gives it up in good form when it fails.
    fn transfer<T>(
        &mut self,
        at: Multiplexer,
        mut attempt: impl FnMut(&mut Channel) -> Result<T, Cause>,
    ) -> Result<T, Error> {
        let mut channel = Channel::new(self.network, self.node, self.options.timeout);
        let mut retries = self.options.retries;
        loop {
            let cause = match attempt(&mut channel) {
                Ok(value) => return Ok(value),
                Err(cause) => cause,
            };
            if let Some(abort) = cause.abort() {
                channel.give_up(at, abort);
            }
            // A server that was left in the middle of a block takes the next request for a segment of it. It has been
            // told now.
            if retries == 0 || !matches!(cause, Cause::NoAnswer | Cause::Unexpected) {
                return Err(Error { node: self.node, at, name: None, cause });
            }
            retries -= 1;
        }
    }
}
