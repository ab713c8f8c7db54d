//! The buffer of an upload. The buffer grows with the data that arrives, whatever size the server announces.

use canopen::client::sdo::Sink;

use super::LARGEST;

#[derive(Default)]
pub(super) struct Memory(pub(super) Vec<u8>);

impl Sink for Memory {
    fn begin(&mut self, size: Option<u32>) -> bool {
        self.0.clear();
        size.is_none_or(|size| size as usize <= LARGEST)
    }

    fn append(&mut self, bytes: &[u8]) -> bool {
        let fits = self.0.len() + bytes.len() <= LARGEST;
        if fits {
            self.0.extend_from_slice(bytes);
        }
        fits
    }
}
