//! The bits of a frame on the wire (ISO 11898-1:2015, 10.4 and 10.5).

use crc::{CRC_15_CAN, Crc, Table};

use crate::{ExtendedId, Frame, Id, StandardId};

/// A level of the wire. Recessive is `true`, so the wire is the logical AND of all driven levels.
pub(crate) type Level = bool;
pub(crate) const DOMINANT: Level = false;
pub(crate) const RECESSIVE: Level = true;

/// Equal bits in a row after which a transmitter inserts the opposite one.
pub(crate) const STUFF_RUN: u8 = 5;
/// Bits of the CRC sequence.
const CRC_BITS: u32 = 15;
/// Bits after the CRC sequence: its delimiter, the ACK slot and delimiter, the end of frame.
const TAIL_BITS: usize = 3 + END_OF_FRAME_BITS;
pub(crate) const END_OF_FRAME_BITS: usize = 7;
/// Recessive bits between two frames.
pub(crate) const INTERMISSION_BITS: u64 = 3;

/// The CRC of a frame. The initial value is zero, so zeros in front of the first bit change nothing: a bit string that
/// is not a whole number of bytes is checked right-aligned.
const CRC: Crc<u16, Table<1>> = Crc::<u16, Table<1>>::new(&CRC_15_CAN);

/// How a transmitter treats a bit of its own that it reads back with the other level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Field {
    /// Identifier, SRR, IDE of an extended frame, RTR: a recessive bit read back dominant means that the arbitration is
    /// lost.
    Arbitration,
    /// A stuff bit inside the arbitration field: a recessive one read back dominant is an error.
    ArbitrationStuff,
    /// The ACK slot: sent recessive, answered dominant by a receiver.
    Ack,
    /// Any other bit.
    Other,
}

/// One bit on the wire.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Bit {
    pub(crate) level: Level,
    pub(crate) field: Field,
}

/// A bit string of up to 128 bits, right-aligned, the first bit the most significant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct BitString {
    pub(crate) bits: u128,
    pub(crate) len: u32,
}

impl BitString {
    pub(crate) fn push(&mut self, value: u32, width: u32) {
        self.bits = self.bits << width | u128::from(value);
        self.len += width;
    }

    /// The `width` bits that begin `from` bits after the first.
    pub(crate) fn field(&self, from: u32, width: u32) -> u32 {
        (self.bits >> (self.len - from - width)) as u32 & ((1 << width) - 1)
    }

    /// The remainder: the CRC sequence of a message, or zero for a message with its CRC sequence.
    pub(crate) fn crc(&self) -> u16 {
        CRC.checksum(&self.bits.to_be_bytes())
    }

    fn levels(self) -> impl Iterator<Item = Level> {
        (0..self.len).rev().map(move |n| self.bits >> n & 1 == 1)
    }
}

/// The bits from start of frame to the last CRC bit, without stuff bits.
fn unstuffed(frame: &Frame) -> BitString {
    let mut bits = BitString::default();
    bits.push(0, 1);
    bits.push(frame.arbitration() >> 21, 11);
    match frame.id() {
        Id::Standard(_) => bits.push(u32::from(frame.is_remote()) << 2, 3),
        Id::Extended(_) => {
            bits.push(frame.arbitration() & 0x1F_FFFF, 21);
            bits.push(0, 2);
        }
    }
    bits.push(u32::from(frame.dlc()), 4);
    frame.bytes().iter().for_each(|byte| bits.push(u32::from(*byte), 8));
    bits.push(u32::from(bits.crc()), CRC_BITS);
    bits
}

/// The frame as its transmitter sends it, from the start of frame to the end of frame.
pub(crate) fn encode(frame: &Frame) -> Vec<Bit> {
    let arbitration = arbitration_bits(frame.id());
    let mut wire = Vec::with_capacity(160);
    let (mut last, mut run) = (RECESSIVE, 0);
    for (n, level) in unstuffed(frame).levels().enumerate() {
        let inside = (1..=arbitration).contains(&n);
        wire.push(Bit { level, field: if inside { Field::Arbitration } else { Field::Other } });
        run = if level == last { run + 1 } else { 1 };
        last = level;
        if run == STUFF_RUN {
            let field = if n < arbitration { Field::ArbitrationStuff } else { Field::Other };
            wire.push(Bit { level: !level, field });
            (last, run) = (!level, 1);
        }
    }
    wire.extend((0..TAIL_BITS).map(tail_bit));
    wire
}

fn tail_bit(n: usize) -> Bit {
    Bit { level: RECESSIVE, field: if n == 1 { Field::Ack } else { Field::Other } }
}

/// Bits after the start of frame in which a transmitter may lose the arbitration.
fn arbitration_bits(id: Id) -> usize {
    match id {
        Id::Standard(_) => 12,
        Id::Extended(_) => 32,
    }
}

/// The number of the bit after the CRC sequence, known once the header is complete.
pub(crate) fn crc_end(bits: &BitString) -> Option<u32> {
    let header = header_bits(bits)?;
    (bits.len >= header).then(|| header + 8 * u32::from(data_bytes(bits, header)) + CRC_BITS)
}

/// Bits from start of frame to data length code, known once the IDE bit has come.
fn header_bits(bits: &BitString) -> Option<u32> {
    (bits.len >= 14).then(|| if bits.field(13, 1) == 1 { 39 } else { 19 })
}

fn data_bytes(bits: &BitString, header: u32) -> u8 {
    if is_remote(bits, header) { 0 } else { dlc(bits, header) }
}

/// The RTR bit is seven bits before the end of the header in both formats.
fn is_remote(bits: &BitString, header: u32) -> bool {
    bits.field(header - 7, 1) == 1
}

/// Data length codes above eight mean eight bytes (ISO 11898-1:2015, 10.4.2.4).
fn dlc(bits: &BitString, header: u32) -> u8 {
    bits.field(header - 4, 4).min(8) as u8
}

/// The frame in a bit string that runs from the start of frame to the last CRC bit.
pub(crate) fn decode(bits: &BitString) -> Option<Frame> {
    let header = header_bits(bits)?;
    let base = bits.field(1, 11);
    let id = if header == 39 {
        Id::Extended(ExtendedId::new(base << 18 | bits.field(14, 18))?)
    } else {
        Id::Standard(StandardId::new(base as u16)?)
    };
    if is_remote(bits, header) {
        return Frame::remote(id, dlc(bits, header));
    }
    let data: Vec<u8> =
        (0..dlc(bits, header)).map(|n| bits.field(header + 8 * u32::from(n), 8) as u8).collect();
    Frame::data(id, &data)
}

/// Bits of a frame on the wire from its start of frame to the end of its intermission, stuff bits included.
pub fn frame_bits(frame: &Frame) -> u64 {
    encode(frame).len() as u64 + INTERMISSION_BITS
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standard(id: u16, data: &[u8]) -> Frame {
        Frame::data(StandardId::new(id).unwrap(), data).unwrap()
    }

    #[test]
    fn an_empty_frame_with_identifier_zero_by_hand() {
        // 0 00000000000 0 0 0 0000 is 19 zeros and so is the CRC: 34 dominant bits. A stuff bit follows the
        // fifth, and since it ends the run, every fifth after that: 34 / 5 = 6.
        assert_eq!(frame_bits(&standard(0, &[])), 34 + 6 + 10 + 3);
    }

    #[test]
    fn the_shortest_frames() {
        // RTR to DLC of an empty data frame are seven dominant bits: one stuff bit at least.
        let data = (0..0x800).map(|id| frame_bits(&standard(id, &[]))).min();
        assert_eq!(data, Some(48));
        let ids = (0..0x800).filter_map(StandardId::new);
        let remote = ids.filter_map(|id| Frame::remote(id, 5)).map(|frame| frame_bits(&frame)).min();
        assert_eq!(remote, Some(47));
    }

    #[test]
    fn eight_bytes_take_111_to_135_bits() {
        let range = 111..=135;
        assert!((0..0x800).all(|id| range.contains(&frame_bits(&standard(id, &[0x55; 8])))));
        assert!((0..=0xFF).all(|byte| range.contains(&frame_bits(&standard(0x78, &[byte; 8])))));
    }

    #[test]
    fn an_encoded_frame_decodes() {
        for frame in [
            standard(0x2A5, &[1, 2, 3]),
            Frame::remote(StandardId::new(0x7FF).unwrap(), 8).unwrap(),
            Frame::data(ExtendedId::new(0x1234_5678).unwrap(), &[0xFF; 8]).unwrap(),
            Frame::remote(ExtendedId::new(0).unwrap(), 0).unwrap(),
        ] {
            let bits = unstuffed(&frame);
            assert_eq!(crc_end(&bits), Some(bits.len));
            assert_eq!(bits.crc(), 0);
            assert_eq!(decode(&bits), Some(frame));
        }
    }
}
