//! A frame in the layout of the mailbox registers (RM0390, CAN mailbox registers).

use canbus::{ExtendedId, Frame, Id, StandardId};

use crate::register::{bit, field, flag};

const IDE: u32 = 2;
const RTR: u32 = 1;

/// The four registers of a mailbox.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Registers {
    /// CAN_TIxR or CAN_RIxR without TXRQ.
    pub(crate) identifier: u32,
    /// CAN_TDTxR or CAN_RDTxR: the length and, for a received frame, the filter match index. Time stamps are not
    /// modelled.
    pub(crate) control: u32,
    /// CAN_xDLxR.
    pub(crate) low: u32,
    /// CAN_xDHxR.
    pub(crate) high: u32,
}

impl Registers {
    /// The registers for a received frame and its filter match index.
    pub(crate) fn of(frame: &Frame, filter_match: u8) -> Registers {
        let mut data = [0; 8];
        data[..frame.bytes().len()].copy_from_slice(frame.bytes());
        // DLC reads 0 for a remote frame (RM0390, CAN_RDTxR).
        let dlc = frame.bytes().len() as u32;
        Registers {
            identifier: identifier(frame),
            control: u32::from(filter_match) << 8 | dlc,
            low: u32::from_le_bytes([data[0], data[1], data[2], data[3]]),
            high: u32::from_le_bytes([data[4], data[5], data[6], data[7]]),
        }
    }

    /// The frame to transmit. Length codes above eight count as eight.
    pub(crate) fn frame(&self) -> Frame {
        let dlc = field(self.control, 0, 4).min(8);
        let id = parse_identifier(self.identifier);
        let mut data = [0; 8];
        data[..4].copy_from_slice(&self.low.to_le_bytes());
        data[4..].copy_from_slice(&self.high.to_le_bytes());
        let frame = if bit(self.identifier, RTR) {
            Frame::remote(id, dlc as u8)
        } else {
            Frame::data(id, &data[..dlc as usize])
        };
        frame.expect("at most eight bytes")
    }

    /// The register at `offset` from the first of the mailbox.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        match offset {
            0x0 => Some(self.identifier),
            0x4 => Some(self.control),
            0x8 => Some(self.low),
            0xC => Some(self.high),
            _ => None,
        }
    }
}

/// STID or EXID, IDE and RTR as CAN_RIxR shows them.
pub(crate) fn identifier(frame: &Frame) -> u32 {
    let id = match frame.id() {
        Id::Standard(id) => u32::from(id.as_raw()) << 21,
        Id::Extended(id) => id.as_raw() << 3 | 1 << IDE,
    };
    id | flag(frame.is_remote(), RTR)
}

fn parse_identifier(register: u32) -> Id {
    let id = if bit(register, IDE) {
        ExtendedId::new(register >> 3).map(Id::from)
    } else {
        StandardId::new(field(register, 21, 11) as u16).map(Id::from)
    };
    id.expect("the field is no wider than the identifier")
}
