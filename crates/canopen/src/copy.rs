//! Copies that cannot panic.

/// Copies as many bytes as the shorter slice has. `copy_from_slice` panics where the lengths differ. Even where a
/// caller has made them equal, a compiler that optimises for size may keep the comparison.
#[inline(never)] // Many callers.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
