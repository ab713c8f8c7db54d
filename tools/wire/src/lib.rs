//! What `nodectl` and the simulator have in common: CAN frames as text, in the lines of [`slcan`] and the messages of
//! [`socketcand`], in both directions; and the names of physical [`mod@unit`]s.
//!
//! `nodectl` is a client of these protocols and the simulator a server, so each has a frame type of its own. A codec takes any
//! [`embedded_can::Frame`]: with a type that has base frames only, an extended frame is no frame. Connections, answers and what a
//! server refuses are the business of the caller.
#![forbid(unsafe_code)]
#![warn(clippy::pedantic)]

mod digits;
pub mod input;
pub mod slcan;
pub mod socketcand;
pub mod stamp;
pub mod unit;

#[cfg(test)]
mod tests {
    use embedded_can::{ExtendedId, Frame, Id, StandardId};
    use proptest::prelude::*;

    fn any_id() -> impl Strategy<Value = Id> {
        let base = (0..=0x7FF_u16).prop_map(|id| Id::Standard(StandardId::new(id).unwrap()));
        let extended = (0..=0x1FFF_FFFF_u32).prop_map(|id| Id::Extended(ExtendedId::new(id).unwrap()));
        prop_oneof![base, extended]
    }

    /// Base and extended, data and remote.
    pub(crate) fn any_frame() -> impl Strategy<Value = canbus::Frame> {
        let bytes = prop::collection::vec(any::<u8>(), 0..=8);
        (any_id(), bytes, any::<bool>()).prop_map(|(id, bytes, is_remote)| {
            let frame = if is_remote { Frame::new_remote(id, bytes.len()) } else { Frame::new(id, &bytes) };
            frame.unwrap()
        })
    }
}
