//! Fastscan (CiA 305, 6.6): the identity of a slave without a node-ID, bit by bit. All that match answer with the
//! same frame, so it does not matter how many they are.

use canopen::lss::{Identity, Part, Request};

use super::Error;

/// Finds one slave and leaves it selected. `is_answered` sends a request and says whether anybody answered in time.
pub(super) fn scan(
    mut is_answered: impl FnMut(Request) -> Result<bool, Error>,
) -> Result<Option<Identity>, Error> {
    let is_anybody = Request::Fastscan { value: 0, bit: Request::CONFIRM, part: 0, next: 0 };
    if !is_answered(is_anybody)? {
        return Ok(None);
    }
    let mut words = [0; 4];
    for ((word, _), part) in words.iter_mut().zip(Part::ALL).zip(0_u8..) {
        *word = scan_part(part, &mut is_answered)?;
    }
    let [vendor, product, revision, serial] = words;
    Ok(Some(Identity { vendor, product, revision, serial }))
}

/// One part of the identity, from the highest bit down: silence means that the bit is 1.
fn scan_part(part: u8, is_answered: &mut impl FnMut(Request) -> Result<bool, Error>) -> Result<u32, Error> {
    let mut value = 0;
    for bit in (0..32).rev() {
        if !is_answered(Request::Fastscan { value, bit, part, next: part })? {
            value |= 1 << bit;
        }
    }
    // The whole part once more: the slave goes on to the next, and after the last it is selected.
    let next = (part + 1) % 4;
    if is_answered(Request::Fastscan { value, bit: 0, part, next })? {
        Ok(value)
    } else {
        Err(Error::NoAnswer { service: "fastscan" })
    }
}
