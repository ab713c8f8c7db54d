//! Time-outs, retries and block size of a client.

use crate::Duration;
use crate::sdo::BlockSize;

/// The time of a segment on its way to the server: a frame and a more urgent one before it, at 10 kbit/s.
pub const SEGMENT_TIME: Duration = Duration::from_millis(30);

/// Time-outs, retries and block size of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// The longest time until the server answers a request. A block has [`SEGMENT_TIME`] more for each of its segments,
    /// because they wait in the adapter, and for more urgent frames on the bus.
    pub timeout: Duration,
    /// The longest time of a transfer, including retries.
    pub limit: Duration,
    /// How often a transfer is restarted when an answer is missing or does not fit, or when the server misses a request.
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
