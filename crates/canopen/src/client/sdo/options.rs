//! How patient a client is.

use crate::Duration;
use crate::sdo::BlockSize;

/// How patient a client is, and how it asks for blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// How long the server may take to answer a request.
    pub timeout: Duration,
    /// How long a transfer may take in all, whatever the server does.
    pub limit: Duration,
    /// How often a transfer that got no answer, or one that does not fit, is begun anew.
    pub retries: u8,
    /// Segments in a block of a block upload.
    pub block_size: BlockSize,
}

impl Default for Options {
    /// One second for an answer, ten seconds in all, one retry, the largest blocks.
    fn default() -> Options {
        Options {
            timeout: Duration::from_millis(1_000),
            limit: Duration::from_millis(10_000),
            retries: 1,
            block_size: BlockSize::MAX,
        }
    }
}
