//! An array of up to `N` bytes.

use crate::copy::copy;

/// Up to `N` bytes (`N` below 256). The unused rest is zero, so that equal content compares equal.
///
/// The alignment makes the size a whole number of words, also inside another structure.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(4))]
pub struct Bytes<const N: usize> {
    data: [u8; N],
    len: u8,
}

impl<const N: usize> Bytes<N> {
    /// The first `len` bytes of `data`, at most all of them.
    #[must_use]
    pub fn new(mut data: [u8; N], len: u8) -> Bytes<N> {
        if len >= Self::CAPACITY {
            return Bytes { data, len: Self::CAPACITY };
        }
        for byte in data.iter_mut().skip(usize::from(len)) {
            *byte = 0;
        }
        Bytes { data, len }
    }

    /// The first bytes of a slice, at most `N`.
    #[must_use]
    #[inline]
    pub fn from_slice(bytes: &[u8]) -> Bytes<N> {
        if let Some(full) = bytes.first_chunk() {
            return Bytes { data: *full, len: Self::CAPACITY };
        }
        let mut data = [0; N];
        copy(&mut data, bytes);
        #[allow(clippy::cast_possible_truncation)] // Below N.
        Bytes { data, len: bytes.len() as u8 }
    }

    #[allow(clippy::cast_possible_truncation)] // N is below 256.
    const CAPACITY: u8 = N as u8;

    /// Number of bytes.
    #[must_use]
    pub fn len(&self) -> u8 {
        self.len
    }

    /// Whether there are no bytes.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The bytes.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        self.data.get(..usize::from(self.len)).unwrap_or(&self.data)
    }

    /// All `N` bytes: the content, followed by zeros.
    #[must_use]
    pub fn padded(&self) -> [u8; N] {
        self.data
    }
}
