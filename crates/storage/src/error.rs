//! Errors of the parameter store.

use core::fmt;

/// Why an operation of the store failed. `E` is the error of the flash driver.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The flash driver reported an error.
    Flash(E),
    /// The two pages do not lie within the flash, or the store or the flash cannot use their size.
    Geometry,
    /// The caller's buffer is shorter than the stored value.
    BufferTooSmall,
    /// A value is longer than [`crate::MAX_VALUE`], or all groups together would not fit an empty page.
    TooLong,
    /// Both pages are used up. Nothing is lost; after [`Store::make_room`](crate::Store::make_room) saving works again.
    Full,
    /// The flash does not hold the data that was read or written before: a worn-out or disturbed cell.
    Corrupt,
}

impl<E: fmt::Debug> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Error::Flash(error) => write!(f, "flash driver: {error:?}"),
            Error::Geometry => f.write_str("the parameter pages do not fit the flash"),
            Error::BufferTooSmall => f.write_str("the buffer is shorter than the stored value"),
            Error::TooLong => f.write_str("the values do not fit a page"),
            Error::Full => f.write_str("both pages are used up, one has to be erased"),
            Error::Corrupt => f.write_str("the flash does not hold what was written"),
        }
    }
}

impl<E: fmt::Debug> core::error::Error for Error<E> {}

impl<E> From<E> for Error<E> {
    fn from(error: E) -> Error<E> {
        Error::Flash(error)
    }
}
