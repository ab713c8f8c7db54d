//! The note that the application and the bootloader leave for each other in RAM that survives a reset: node-ID and bit
//! rate in use, and whether the bootloader must stay on the bus.
//!
//! A bootloader that joined a bus without knowing its bit rate would destroy the frames of others. The application
//! therefore notes the rate in use, which under automatic detection is the detected one.

use crate::can::bit_timing::BitTiming;

/// The note.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Handover {
    /// Node-ID in use; `None` for a node that waits for LSS to assign one.
    pub node_id: Option<u8>,
    /// Bit timing in use.
    pub timing: BitTiming,
    /// The bootloader was requested (1F51h = 0 or 2), so it stays although there is an application.
    pub stay: bool,
}

/// The words in RAM: the note and its complement. Random content of RAM after power-up has no such pair.
pub type Sealed = [u32; 2];

impl Handover {
    /// The words to store.
    #[must_use]
    pub fn seal(&self) -> Sealed {
        let [low, high] = self.timing.kbit().to_le_bytes();
        let note = u32::from_le_bytes([self.node_id.unwrap_or(0), low, high, self.stay.into()]);
        [note, !note]
    }

    /// The note in the words; `None` without one.
    #[must_use]
    pub fn open(words: &Sealed) -> Option<Handover> {
        let [note, complement] = *words;
        let [node_id, low, high, stay] = note.to_le_bytes();
        let timing = BitTiming::of(u16::from_le_bytes([low, high]))?;
        let node_id = (node_id != 0).then_some(node_id);
        (complement == !note).then_some(Handover { node_id, timing, stay: stay == 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_note_survives_the_handover() {
        for kbit in [10, 20, 50, 125, 250, 500, 800, 1000] {
            for (node_id, stay) in [(None, false), (Some(1), true), (Some(127), false)] {
                let note = Handover { node_id, timing: BitTiming::of(kbit).unwrap(), stay };
                assert_eq!(Handover::open(&note.seal()), Some(note));
            }
        }
    }

    #[test]
    fn random_ram_after_power_up_is_no_note() {
        for words in [[0, 0], [u32::MAX; 2], [0, u32::MAX], [u32::MAX, 0], [0xA5A5_A5A5; 2]] {
            assert_eq!(Handover::open(&words), None);
        }
        let [note, complement] = Handover { node_id: Some(5), timing: BitTiming::FASTEST, stay: true }.seal();
        assert_eq!(Handover::open(&[note ^ 1, complement]), None);
    }
}
