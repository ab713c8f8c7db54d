//! The flash interface of the update.

use embedded_storage::nor_flash::ReadNorFlash;

use crate::refusal::Refusal;

/// A NOR flash with sectors of different sizes whose erase runs in the background. `embedded_storage::NorFlash`
/// supports neither: it has one `ERASE_SIZE`, and its `erase` returns only when the erase is done.
///
/// Offsets count from the start of the flash. Reads must return the content of the cells: a driver flushes the caches
/// after programming or erasing, because everything is read back.
pub trait Flash: ReadNorFlash {
    /// Bytes of a word, the unit of programming: 4 or 8.
    fn word_size(&self) -> u32 {
        4
    }

    /// Programs whole words at a multiple of their size. Either the words were erased before, or all of `bytes` are 0:
    /// zeros may be programmed over anything. In a word without check bits this works because a bit may go from 1 to 0
    /// without an erase (RM0390, 3.5.2; RM0090, 3.6.3); in a word with check bits it is an exception (RM0440, 3.3.8).
    ///
    /// # Errors
    /// The flash reports that programming failed.
    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error>;

    /// Starts the erase of the sector at `offset`.
    ///
    /// # Errors
    /// The flash refuses the erase.
    fn start_erase(&mut self, offset: u32) -> Result<(), Self::Error>;

    /// Whether an erase is in progress; the flash is not read or programmed during that time.
    ///
    /// # Errors
    /// The erase has ended and failed.
    fn is_busy(&mut self) -> Result<bool, Self::Error>;
}

impl<F: Flash> Flash for &mut F {
    fn word_size(&self) -> u32 {
        (**self).word_size()
    }

    fn program(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        (**self).program(offset, bytes)
    }

    fn start_erase(&mut self, offset: u32) -> Result<(), Self::Error> {
        (**self).start_erase(offset)
    }

    fn is_busy(&mut self) -> Result<bool, Self::Error> {
        (**self).is_busy()
    }
}

/// Bytes programmed in one step: 64 words, 1 ms (16 us a word), at most 6.4 ms.
pub(crate) const CHUNK: usize = CHUNK_LEN as usize;
/// The same number, as a distance in flash.
pub(crate) const CHUNK_LEN: u32 = 256;
/// Number of pieces read and checked in one step: 1 KiB.
pub(crate) const PIECES: u32 = 4;

/// Reads the next bytes of `rest` into the buffer, as many as fit, and removes them from `rest`. No bytes are left at
/// the end.
#[inline(never)] // Many callers, and little room in flash.
pub(crate) fn read_piece<'a, F: Flash>(
    flash: &mut F,
    rest: &mut core::ops::Range<u32>,
    buffer: &'a mut [u8; CHUNK],
) -> Result<&'a [u8], Refusal> {
    let piece = first(buffer, rest.end.saturating_sub(rest.start));
    flash.read(rest.start, piece).map_err(|_| Refusal::Unspecified)?;
    rest.start = rest.end.min(rest.start.saturating_add(CHUNK_LEN));
    Ok(piece)
}

/// Whether all bytes have this value.
#[inline(never)] // Many callers, and little room in flash.
pub(crate) fn all_are(bytes: &[u8], value: u8) -> bool {
    bytes.iter().all(|byte| *byte == value)
}

/// At most `len` bytes of `buffer`.
pub(crate) fn first(buffer: &mut [u8], len: u32) -> &mut [u8] {
    let len = buffer.len().min(len as usize);
    buffer.split_at_mut(len).0
}

/// Programs at most [`CHUNK`] bytes, and reads them back. The rest of the last word gets the value of erased cells.
pub(crate) fn program<F: Flash>(flash: &mut F, at: u32, bytes: &[u8]) -> Result<(), Refusal> {
    let mut buffer = [0xFF; CHUNK];
    buffer.iter_mut().zip(bytes).for_each(|(to, byte)| *to = *byte);
    let len = u32::try_from(bytes.len()).unwrap_or(u32::MAX);
    let words = first(&mut buffer, len.next_multiple_of(flash.word_size().max(4)));
    flash.program(at, words).map_err(|_| Refusal::Write)?;
    let read = first(&mut buffer, u32::try_from(bytes.len()).unwrap_or(u32::MAX));
    flash.read(at, read).map_err(|_| Refusal::Unspecified)?;
    if read == bytes { Ok(()) } else { Err(Refusal::Write) }
}
