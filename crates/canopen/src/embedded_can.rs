//! Conversion of [`Frame`] to and from the frames of embedded-can drivers.

use embedded_can::{Frame as Driver, Id, StandardId};

use crate::Frame;

/// Base frames only: `new` and `new_remote` return `None` for an extended identifier.
impl Driver for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Frame> {
        match id.into() {
            Id::Standard(id) => Frame::new(id.as_raw(), data),
            Id::Extended(_) => None,
        }
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Frame> {
        match id.into() {
            Id::Standard(id) => Frame::remote(id.as_raw(), u8::try_from(dlc).ok()?),
            Id::Extended(_) => None,
        }
    }

    fn is_extended(&self) -> bool {
        false
    }

    fn is_remote_frame(&self) -> bool {
        self.is_remote()
    }

    fn id(&self) -> Id {
        Id::Standard(StandardId::new(Frame::id(self)).unwrap_or(StandardId::ZERO))
    }

    fn dlc(&self) -> usize {
        self.len()
    }

    fn data(&self) -> &[u8] {
        Frame::data(self)
    }
}

/// Converts a frame of a driver; `None` for an extended identifier, which this crate does not use.
pub fn from_driver(frame: &impl Driver) -> Option<Frame> {
    if frame.is_remote_frame() {
        <Frame as Driver>::new_remote(frame.id(), frame.dlc())
    } else {
        <Frame as Driver>::new(frame.id(), frame.data())
    }
}

/// Converts a frame for a driver; `None` if the driver refuses it.
#[must_use]
pub fn to_driver<F: Driver>(frame: &Frame) -> Option<F> {
    let id = StandardId::new(frame.id())?;
    if frame.is_remote() { F::new_remote(id, frame.len()) } else { F::new(id, frame.data()) }
}

#[cfg(test)]
mod tests {
    use embedded_can::ExtendedId;

    use super::*;

    #[test]
    fn a_frame_crosses_a_driver_unchanged() {
        let data = Frame::new(0x181, &[1, 2, 3]);
        for frame in [data, Frame::new(0x7FF, &[]), Frame::remote(0x701, 8)].map(Option::unwrap) {
            assert_eq!(from_driver(&to_driver::<Frame>(&frame).unwrap()), Some(frame));
            assert_eq!((Driver::dlc(&frame), frame.is_extended()), (frame.len(), false));
        }
    }

    #[test]
    fn extended_identifiers_are_not_taken() {
        let id = ExtendedId::new(0x181).unwrap();
        assert_eq!(<Frame as Driver>::new(id, &[1]), None);
        assert_eq!(<Frame as Driver>::new_remote(id, 1), None);
    }
}
