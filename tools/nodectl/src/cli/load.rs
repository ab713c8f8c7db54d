//! The part of the bus that a frame takes.

/// Bits of a base frame with this number of data bytes, with the interframe space and an estimate of the stuff bits. The
/// estimate is one stuff bit for sixteen bits, which lies between the numbers for counting data and for zeros.
pub(super) fn bits(data_bytes: usize) -> u64 {
    let data = 8 * data_bytes as u64;
    47 + data + (34 + data) / 16
}
