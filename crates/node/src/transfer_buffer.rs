//! Object 2F00h: a domain of 4 KiB in RAM that returns the data written to it, for testing and measuring transfers.

use canopen::Part;
use canopen::sdo::Abort;
use heapless::Vec;

/// Capacity in bytes.
const CAPACITY: usize = 4096;

/// The buffer and its content. An aborted download leaves it empty.
#[derive(Debug)]
pub(crate) struct TransferBuffer {
    bytes: Vec<u8, CAPACITY>,
    is_complete: bool,
}

impl TransferBuffer {
    pub(crate) const EMPTY: TransferBuffer = TransferBuffer { bytes: Vec::new(), is_complete: false };

    pub(crate) fn read(&self) -> Result<&[u8], Abort> {
        if self.is_complete && !self.bytes.is_empty() { Ok(&self.bytes) } else { Err(Abort::NoData) }
    }

    pub(crate) fn write(&mut self, part: Part<'_>) -> Result<(), Abort> {
        match part {
            Part::Begin(Some(len)) if len > CAPACITY => return Err(Abort::TooLong),
            Part::Begin(_) => {
                self.bytes.clear();
                self.is_complete = false;
            }
            Part::Data(_, bytes) => self.bytes.extend_from_slice(bytes).map_err(|_| Abort::TooLong)?,
            Part::End(_) => self.is_complete = true,
        }
        Ok(())
    }
}
