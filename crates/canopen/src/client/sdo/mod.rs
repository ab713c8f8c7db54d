//! The SDO client (CiA 301, 7.2.4): reads and writes the objects of one node.
//!
//! | Transfer | Reads | Writes |
//! |---|---|---|
//! | expedited (up to 4 bytes) and segmented | [`Upload`] | [`Download`] |
//! | in blocks of up to 127 segments, with a CRC | [`BlockUpload`] | [`BlockDownload`] |
//!
//! All four are a [`Service`](super::Service). Lost segments of a block are sent again. A transfer whose answer is lost
//! is aborted and restarted, as often as [`Options`] allow. One time limit covers all attempts.

mod abort_code;
mod block_download;
mod block_upload;
mod download;
mod error;
mod link;
mod options;
mod sink;
mod transfer;
mod upload;

pub use abort_code::AbortCode;
pub use error::Error;
pub use link::Channel;
pub use options::{Options, SEGMENT_TIME};
pub use sink::{Buffer, Sink};
pub use transfer::Transfer;

/// Reads an object: expedited or segmented, as the server chooses (CiA 301, 7.2.4.3.5 and 7.2.4.3.6).
pub type Upload<S> = Transfer<upload::Protocol<S>>;
/// Writes an object: 1 to 4 bytes expedited, any other length segmented (CiA 301, 7.2.4.3.3 and 7.2.4.3.4).
pub type Download<'a> = Transfer<download::Protocol<'a>>;
/// Reads an object in blocks (CiA 301, 7.2.4.3.13 to 15). For a short object, the server may choose an [`Upload`].
pub type BlockUpload<S> = Transfer<block_upload::Protocol<S>>;
/// Writes an object in blocks (CiA 301, 7.2.4.3.9 to 11).
pub type BlockDownload<'a> = Transfer<block_download::Protocol<'a>>;
