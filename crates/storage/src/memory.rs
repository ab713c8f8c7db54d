//! A flash in memory: a read-only dump, or a buffer that is provisioned on the host.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// The bytes of a flash from its first address. A shared slice can be read; `&mut [u8]`, an array or a `Vec<u8>` can
/// also be written. Writing clears bits, as in a real flash.
#[derive(Clone, Debug)]
pub struct Memory<T>(
    /// The content.
    pub T,
);

impl<T> ErrorType for Memory<T> {
    type Error = NorFlashErrorKind;
}

impl<T: AsRef<[u8]>> ReadNorFlash for Memory<T> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NorFlashErrorKind> {
        check_read(self, offset, bytes.len())?;
        let source = self.0.as_ref().iter().skip(offset as usize);
        bytes.iter_mut().zip(source).for_each(|(to, from)| *to = *from);
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.0.as_ref().len()
    }
}

impl<T: AsRef<[u8]> + AsMut<[u8]>> NorFlash for Memory<T> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), NorFlashErrorKind> {
        check_erase(self, from, to)?;
        let range = from as usize..to as usize;
        self.0.as_mut().get_mut(range).ok_or(NorFlashErrorKind::OutOfBounds)?.fill(0xFF);
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NorFlashErrorKind> {
        check_write(self, offset, bytes.len())?;
        let target = self.0.as_mut().iter_mut().skip(offset as usize);
        target.zip(bytes).for_each(|(to, from)| *to &= from);
        Ok(())
    }
}
