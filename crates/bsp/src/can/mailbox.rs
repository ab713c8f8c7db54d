//! A frame in the registers of a mailbox (RM0390, 30.9.3); transmit mailboxes have the same layout.
//!
//! The crate bxcan is not used for reception: it does not limit the length code and indexes out of range at the codes 9
//! to 15, which any node may send for eight bytes (ISO 11898-1, 10.4.2.4).

use canopen::Frame;

const EXTENDED: u32 = 1 << 2;
/// RTR: remote frame.
pub(crate) const REMOTE: u32 = 1 << 1;

/// The registers RIR, RDTR, RDLR and RDHR.
#[derive(Clone, Copy, Debug)]
pub struct Mailbox {
    /// Identifier, IDE and RTR.
    pub rir: u32,
    /// Length code and time stamp.
    pub rdtr: u32,
    /// Data bytes 0 to 3.
    pub rdlr: u32,
    /// Data bytes 4 to 7.
    pub rdhr: u32,
}

impl Mailbox {
    /// The frame; `None` for an extended identifier, which CANopen does not use.
    #[must_use]
    pub fn frame(&self) -> Option<Frame> {
        let id = u16::try_from(self.rir >> 21).ok()?;
        let length = (self.rdtr & 0xF).min(8);
        match (self.rir & EXTENDED != 0, self.rir & REMOTE != 0) {
            (true, _) => None,
            (false, true) => Frame::remote(id, u8::try_from(length).ok()?),
            (false, false) => Frame::new(id, self.bytes().get(..length as usize)?),
        }
    }

    fn bytes(&self) -> [u8; 8] {
        (u64::from(self.rdhr) << 32 | u64::from(self.rdlr)).to_le_bytes()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mailbox(rir: u32, length: u32) -> Mailbox {
        Mailbox { rir, rdtr: 0xABCD_0500 | length, rdlr: 0x4433_2211, rdhr: 0x8877_6655 }
    }

    #[test]
    fn bytes_come_in_the_order_of_the_wire() {
        let frame = mailbox(0x601 << 21, 6).frame();
        assert_eq!(frame, Frame::new(0x601, &[0x11, 0x22, 0x33, 0x44, 0x55, 0x66]));
    }

    #[test]
    fn every_length_code_above_eight_means_eight() {
        for code in 8..=15 {
            assert_eq!(mailbox(0x7FF << 21, code).frame().map(|frame| frame.len()), Some(8));
            assert_eq!(mailbox(REMOTE, code).frame(), Frame::remote(0, 8));
        }
    }

    #[test]
    fn an_extended_identifier_is_none_of_ours() {
        assert_eq!(mailbox(EXTENDED | 0x601 << 21, 8).frame(), None);
        assert_eq!(mailbox(EXTENDED | REMOTE, 0).frame(), None);
    }
}
