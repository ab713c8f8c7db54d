//! The configured TPDOs of a node, and the values in their frames.

use canopen::CobId;
use canopen::pdo::MappedObject;
use canopen::sdo::Multiplexer;

use crate::Catalogue;
use crate::object::at;
use crate::pdo_parameters::{Parameters, slots, walk};
use crate::sdo::{Client, Error};

/// A TPDO that is switched on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tpdo {
    /// The number of the TPDO, from 1.
    pub number: u16,
    /// The CAN-ID.
    pub id: u16,
    /// The mapped objects, from the first bit on.
    pub mapping: Vec<MappedObject>,
}

impl Tpdo {
    /// The bytes of each value in a frame. A value that the frame does not contain completely is left out.
    pub fn values<'a>(&'a self, data: &'a [u8]) -> impl Iterator<Item = (Multiplexer, Vec<u8>)> + 'a {
        let mut offset = 0;
        self.mapping.iter().filter_map(move |mapped| {
            let (from, length) = (offset, usize::from(mapped.bits));
            offset += length;
            Some((at(mapped.index, mapped.sub), bits(data, from, length)?))
        })
    }
}

/// Bits of a frame in as few bytes as possible. The first bit is the lowest bit of the first byte.
fn bits(data: &[u8], from: usize, length: usize) -> Option<Vec<u8>> {
    if from + length > 8 * data.len() || length == 0 {
        return None;
    }
    let bit = |number: usize| data[number / 8] >> (number % 8) & 1;
    let mut bytes = vec![0; length.div_ceil(8)];
    for number in 0..length {
        bytes[number / 8] |= bit(from + number) << (number % 8);
    }
    Some(bytes)
}

/// The TPDOs of a node that are switched on.
///
/// # Errors
/// SDO errors.
pub fn read(client: &mut Client, catalogue: &Catalogue) -> Result<Vec<Tpdo>, Error> {
    let mut found = Vec::new();
    walk(catalogue, 0x1800, |pdo| {
        let cob_id = word(client, at(pdo.communication, 1))?;
        if let Some(cob_id) = cob_id {
            found.extend(read_one(client, pdo, cob_id)?);
        }
        Ok(cob_id.is_some())
    })?;
    Ok(found)
}

fn read_one(client: &mut Client, pdo: Parameters, cob_id: u32) -> Result<Option<Tpdo>, Error> {
    // With bit 31 the PDO is off. A PDO with a 29-bit identifier is not supported here.
    let Some(cob_id) = CobId::parse(cob_id).filter(|cob_id| !cob_id.bit31) else { return Ok(None) };
    let count = client.upload(at(pdo.mapping, 0))?.first().copied().unwrap_or(0);
    let mut mapping = Vec::new();
    for slot in slots(count.into()) {
        mapping.extend(word(client, at(pdo.mapping, slot))?.map(MappedObject::parse));
    }
    Ok(Some(Tpdo { number: pdo.number + 1, id: cob_id.id.get(), mapping }))
}

fn word(client: &mut Client, at: Multiplexer) -> Result<Option<u32>, Error> {
    match client.upload(at) {
        Ok(bytes) => Ok(bytes.try_into().ok().map(u32::from_le_bytes)),
        Err(error) if error.is_absent() => Ok(None),
        Err(error) => Err(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tpdo(mapping: &[(u16, u8, u8)]) -> Tpdo {
        let mapping = mapping.iter().map(|&(index, sub, bits)| MappedObject { index, sub, bits }).collect();
        Tpdo { number: 1, id: 0x181, mapping }
    }

    #[test]
    fn values_of_whole_bytes() {
        let tpdo = tpdo(&[(0x6130, 1, 32), (0x6150, 1, 8), (0x7130, 2, 16)]);
        let values: Vec<_> = tpdo.values(&[1, 2, 3, 4, 5, 6, 7, 8]).collect();
        let expected =
            [(at(0x6130, 1), vec![1, 2, 3, 4]), (at(0x6150, 1), vec![5]), (at(0x7130, 2), vec![6, 7])];
        assert_eq!(values, expected);
    }

    #[test]
    fn values_of_single_bits_and_across_bytes() {
        let tpdo = tpdo(&[(0x2000, 0, 1), (0x2001, 0, 3), (0x2002, 0, 8), (0x2003, 0, 4)]);
        // From the lowest bit on: 1, 101b, 1111_0010b, 1010b.
        let values: Vec<_> = tpdo.values(&[0b0010_1011, 0b1010_1111]).map(|(_, bytes)| bytes).collect();
        assert_eq!(values, [vec![1], vec![0b101], vec![0b1111_0010], vec![0b1010]]);
    }

    #[test]
    fn a_frame_that_is_too_short_has_the_values_that_fit() {
        let tpdo = tpdo(&[(0x2000, 0, 16), (0x2001, 0, 16)]);
        assert_eq!(tpdo.values(&[1, 2, 3]).count(), 1);
        assert_eq!(tpdo.values(&[]).count(), 0);
    }
}
