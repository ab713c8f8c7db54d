//! Search for the PDOs of a node: the records from 1400h and 1800h on, and their mappings 200h above.

use std::ops::RangeInclusive;

use crate::Catalogue;
use crate::object::at;

/// After this number of missing PDOs in a row, only PDOs of the data sheet are looked for. Devices may leave gaps.
const GAP: u16 = 4;
/// The greatest number of PDOs of each kind (CiA 301, 7.5.2.35 and 7.5.2.37).
pub(crate) const PDOS: u16 = 512;
/// A larger number of mapped objects stands for a kind of MPDO (CiA 301, 7.5.2.36).
const SLOTS: u8 = 64;

/// Indices of the parameters of one PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Parameters {
    /// The number of the PDO, from 0.
    pub(crate) number: u16,
    pub(crate) communication: u16,
    pub(crate) mapping: u16,
}

/// Visits the PDOs of a kind. `first` is 1400h or 1800h; `visit` returns whether the PDO exists.
///
/// # Errors
/// The errors of `visit`.
pub(crate) fn walk<E>(
    catalogue: &Catalogue,
    first: u16,
    mut visit: impl FnMut(Parameters) -> Result<bool, E>,
) -> Result<(), E> {
    let mut missing = 0;
    for number in 0..PDOS {
        let communication = first + number;
        if missing >= GAP && catalogue.entry(at(communication, 1)).is_none() {
            continue;
        }
        let exists = visit(Parameters { number, communication, mapping: communication + 0x200 })?;
        missing = if exists { 0 } else { missing + 1 };
    }
    Ok(())
}

/// The sub-indices of the mapped objects, by the value of sub-index 0.
pub(crate) fn slots(count: u32) -> RangeInclusive<u8> {
    1..=u8::try_from(count).ok().filter(|count| *count <= SLOTS).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_of_three_is_passed_and_one_of_four_is_the_end() {
        let mut asked = Vec::new();
        let visit = |parameters: Parameters| {
            asked.push(parameters.number);
            Ok::<_, ()>([0, 4].contains(&parameters.number))
        };
        walk(&Catalogue::unknown(), 0x1800, visit).unwrap();
        assert_eq!(asked, [0, 1, 2, 3, 4, 5, 6, 7, 8]);
    }

    #[test]
    fn a_mapping_has_up_to_64_objects() {
        assert_eq!(slots(0).count(), 0);
        assert_eq!(slots(64), 1..=64);
        for count in [65, 0xFE, 0x100, u32::MAX] {
            assert_eq!(slots(count).count(), 0, "{count}");
        }
    }
}
