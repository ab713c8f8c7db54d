//! Time-outs, retries and block size of a client.

use crate::Duration;
use crate::sdo::BlockSize;

/// Time-outs, retries and block size of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The longest time until the server answers a request.
    pub timeout: Duration,
    /// The longest time of a transfer, including retries.
    pub limit: Duration,
    /// How often a transfer is restarted when an answer is missing or does not fit.
    pub retries: u8,
    /// Segments in a block of a block upload, 1 to 127.
    pub block_size: BlockSize,
}

impl Default for Options {
    /// One second for an answer, ten seconds for the transfer, one retry, the largest blocks.
    fn default() -> Options {
        Options {
            timeout: Duration::from_millis(1_000),
            limit: Duration::from_millis(10_000),
            retries: 1,
            block_size: BlockSize::MAX,
        }
    }
}
