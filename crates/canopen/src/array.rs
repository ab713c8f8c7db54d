//! Arrays whose length follows from the rows of a device.

use core::fmt::Debug;

/// An element that is the same in every new array, best all zeros: an array of zeros is set by one call.
pub trait Element: Debug {
    /// The element of a new array.
    const NEW: Self;
}

impl Element for u8 {
    const NEW: u8 = 0;
}

/// An array of any length.
pub trait Array<T>: AsRef<[T]> + AsMut<[T]> + Debug {
    /// A new array.
    const NEW: Self;
}

impl<T: Element, const N: usize> Array<T> for [T; N] {
    const NEW: [T; N] = [const { T::NEW }; N];
}
