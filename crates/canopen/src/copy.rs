//! Copies that cannot panic.

/// Copies as many bytes as both have. `copy_from_slice` panics where the lengths differ, and where a caller has made them
/// equal, a compiler that goes for size may compare them all the same.
#[inline]
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
