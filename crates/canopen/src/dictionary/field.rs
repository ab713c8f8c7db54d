//! The location of one value in the image of all values.

use crate::sdo::Bytes;

/// Offset and size of a value in the image.
///
/// Beyond the end of an image that is too short, a value reads as zero and a write has no effect; nothing panics.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Field {
    pub(crate) offset: u16,
    pub(crate) size: u8,
}

impl Field {
    /// The bytes of the value.
    #[must_use]
    pub fn get(self, image: &[u8]) -> &[u8] {
        let start = usize::from(self.offset);
        image.get(start..start + usize::from(self.size)).unwrap_or(&[])
    }

    /// Replaces the value as `set` does. `value` is the first four bytes as a number: a value of four bytes, the most
    /// frequent size, needs no call of `set`.
    #[inline]
    pub(crate) fn set_number(self, image: &mut [u8], value: u32, bytes: &[u8]) {
        match self.size {
            4 => self.store(image, value.to_le_bytes()),
            _ => self.set(image, bytes),
        }
    }

    /// Replaces the value. If `bytes` is shorter than the value, zeros follow; if it is longer, the rest is ignored.
    pub fn set(self, image: &mut [u8], bytes: &[u8]) {
        // The frequent sizes. A copy of fixed size is cheap.
        match (self.size, bytes.first_chunk(), bytes.first_chunk()) {
            (4, Some(word), _) => return self.store::<4>(image, *word),
            (8, _, Some(words)) => return self.store::<8>(image, *words),
            _ => (),
        }
        let start = usize::from(self.offset);
        let Some(place) = image.get_mut(start..start + usize::from(self.size)) else { return };
        let (value, rest) = place.split_at_mut(bytes.len().min(place.len()));
        for (to, from) in value.iter_mut().zip(bytes) {
            *to = *from;
        }
        rest.fill(0);
    }

    /// The offset after the value. Saturates for a field outside every image.
    pub(crate) fn end(self) -> u16 {
        self.offset.saturating_add(self.size.into())
    }

    /// Eight bytes from the start of the value; bytes beyond the image are zero.
    pub(crate) fn eight(self, image: &[u8]) -> [u8; 8] {
        let rest = image.get(usize::from(self.offset)..);
        match rest.and_then(<[u8]>::first_chunk) {
            Some(all) => *all,
            None => padded(rest.unwrap_or(&[])),
        }
    }

    /// The first `K` bytes from the start of the value.
    #[must_use]
    pub fn load<const K: usize>(self, image: &[u8]) -> [u8; K] {
        image.get(usize::from(self.offset)..).and_then(|rest| rest.first_chunk()).copied().unwrap_or([0; K])
    }

    /// Replaces the first `K` bytes from the start of the value. Like `set`, for a size that is known at compile time.
    pub fn store<const K: usize>(self, image: &mut [u8], bytes: [u8; K]) {
        if let Some(place) = image.get_mut(usize::from(self.offset)..).and_then(|rest| rest.first_chunk_mut())
        {
            *place = bytes;
        }
    }

    /// The value of an UNSIGNED8.
    #[must_use]
    pub fn u8(self, image: &[u8]) -> u8 {
        u8::from_le_bytes(self.load(image))
    }

    /// The value of an UNSIGNED16.
    #[must_use]
    pub fn u16(self, image: &[u8]) -> u16 {
        u16::from_le_bytes(self.load(image))
    }

    /// The value of an UNSIGNED32.
    #[must_use]
    pub fn u32(self, image: &[u8]) -> u32 {
        u32::from_le_bytes(self.load(image))
    }

    /// The value of a REAL32.
    #[must_use]
    pub fn f32(self, image: &[u8]) -> f32 {
        f32::from_le_bytes(self.load(image))
    }
}

/// The last bytes of an image, followed by zeros.
#[inline(never)]
fn padded(rest: &[u8]) -> [u8; 8] {
    Bytes::from_slice(rest).padded()
}
