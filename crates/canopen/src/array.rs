//! Arrays whose length follows from the rows of a device.

use core::fmt::Debug;

/// An array of any length.
pub trait Array<T>: AsRef<[T]> + AsMut<[T]> + Debug {
    /// An array of equal elements.
    fn filled(element: impl Fn() -> T) -> Self;
}

impl<T: Debug, const N: usize> Array<T> for [T; N] {
    fn filled(element: impl Fn() -> T) -> Self {
        core::array::from_fn(|_| element())
    }
}
