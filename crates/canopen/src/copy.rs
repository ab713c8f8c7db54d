//! Copies that cannot panic.

/// Copies as many bytes as the shorter slice has. `copy_from_slice` panics where the lengths differ. Even where a
/// caller has made them equal, a compiler that optimises for size may keep the comparison.
#[inline(never)] // Many callers.
pub(crate) fn copy(to: &mut [u8], from: &[u8]) {
    let len = to.len().min(from.len());
    let (to, from) = (to.get_mut(..len).unwrap_or_default(), from.get(..len).unwrap_or_default());
    // Most bytes are copied as words.
    let ((to_words, to), (words, from)) = (to.as_chunks_mut::<4>(), from.as_chunks::<4>());
    to_words.iter_mut().zip(words).for_each(|(to, from)| *to = *from);
    to.iter_mut().zip(from).for_each(|(to, from)| *to = *from);
}
