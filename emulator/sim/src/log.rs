//! The firmware's log: defmt frames in a ring buffer in the board's RAM, read in the same way as by a debug probe.
//!
//! Layout of the control block: SEGGER, "J-Link User Guide" UM08001, chapter RTT; `defmt-rtt` has one up-channel.

use canbus::Time;
use defmt_decoder::{DecodeError, Frame, Table};

use crate::cli::LogLevel;

/// One line of a board's log.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Virtual time of the read, at most a millisecond after the line was written.
    pub at: Time,
    /// The node of the board.
    pub node: u8,
    /// The log level.
    pub level: LogLevel,
    /// The message.
    pub text: String,
}

/// Access to the RAM of a board, like that of a debug probe.
pub(crate) trait Ram {
    /// Reads bytes at an absolute address; `None` outside of RAM.
    fn read(&self, address: u32, bytes: &mut [u8]) -> Option<()>;
    /// Writes bytes at an absolute address; `None` outside of RAM.
    fn write(&mut self, address: u32, bytes: &[u8]) -> Option<()>;
}

/// The magic number of the control block; the firmware writes it at start-up.
const MAGIC: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// Offsets from the control block: buffer, size, write offset and read offset of up-channel 0.
const UP_CHANNEL: u32 = 28;
const READ_OFFSET: u32 = 40;
/// Maximum size of the ring; a larger value is treated as garbage.
const MAX_RING: u32 = 0x1_0000;

/// Moves the bytes that the firmware has written since the last call out of the ring.
pub(crate) fn drain(ram: &mut dyn Ram, control_block: u32, into: &mut Vec<u8>) -> Option<()> {
    let mut magic = [0; 16];
    ram.read(control_block, &mut magic)?;
    let [buffer, size, write, read] = words(ram, control_block + UP_CHANNEL)?;
    if magic != *MAGIC || write == read || size > MAX_RING || write >= size || read >= size {
        return None;
    }
    let parts = if read < write { [read..write, 0..0] } else { [read..size, 0..write] };
    for part in parts {
        let start = into.len();
        into.resize(start + part.len(), 0);
        ram.read(buffer.checked_add(part.start)?, &mut into[start..])?;
    }
    ram.write(control_block + READ_OFFSET, &write.to_le_bytes())
}

fn words<const N: usize>(ram: &dyn Ram, address: u32) -> Option<[u32; N]> {
    let mut words = [0; N];
    for (word, address) in words.iter_mut().zip((address..).step_by(4)) {
        let mut bytes = [0; 4];
        ram.read(address, &mut bytes)?;
        *word = u32::from_le_bytes(bytes);
    }
    Some(words)
}

/// The decoder of the drained bytes.
#[derive(Debug, Default)]
pub(crate) struct Log {
    pending: Vec<u8>,
}

impl Log {
    /// Reads the ring and passes every complete line to `sink`.
    pub(crate) fn poll(
        &mut self,
        table: &Table,
        ram: &mut dyn Ram,
        control_block: u32,
        sink: &mut dyn FnMut(LogLevel, String),
    ) {
        if drain(ram, control_block, &mut self.pending).is_some() {
            self.decode(table, sink);
        }
    }

    /// Decodes complete frames. Frames end with a zero (rzCOBS, which defmt uses by default); an incomplete frame stays
    /// pending.
    fn decode(&mut self, table: &Table, sink: &mut dyn FnMut(LogLevel, String)) {
        let Some(end) = self.pending.iter().rposition(|&byte| byte == 0) else { return };
        let mut decoder = table.new_stream_decoder();
        decoder.received(&self.pending[..=end]);
        self.pending.drain(..=end);
        loop {
            match decoder.decode() {
                Ok(frame) => sink(level(&frame), frame.display_message().to_string()),
                Err(DecodeError::Malformed) => {
                    sink(LogLevel::Warn, "(a log frame that cannot be read)".into());
                }
                Err(DecodeError::UnexpectedEof) => return,
            }
        }
    }
}

/// The level of a frame. `println!` has no level and is always shown.
fn level(frame: &Frame) -> LogLevel {
    match frame.level().map(|level| level.as_str()) {
        Some("trace") => LogLevel::Trace,
        Some("debug") => LogLevel::Debug,
        Some("info") => LogLevel::Info,
        Some("warn") => LogLevel::Warn,
        _ => LogLevel::Error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BASE: u32 = 0x2000_0000;

    impl Ram for Vec<u8> {
        fn read(&self, address: u32, bytes: &mut [u8]) -> Option<()> {
            let start = address.checked_sub(BASE)? as usize;
            bytes.copy_from_slice(self.get(start..start + bytes.len())?);
            Some(())
        }

        fn write(&mut self, address: u32, bytes: &[u8]) -> Option<()> {
            let start = address.checked_sub(BASE)? as usize;
            self.get_mut(start..start + bytes.len())?.copy_from_slice(bytes);
            Some(())
        }
    }

    /// A control block at the start of RAM with a ring of eight bytes, `0` to `7`, behind it.
    fn ram(write: u32, read: u32) -> Vec<u8> {
        let mut ram = MAGIC.to_vec();
        for word in [1, 0, 0, BASE + 48, 8, write, read, 0] {
            ram.extend(u32::to_le_bytes(word));
        }
        ram.extend(0..8);
        ram
    }

    fn taken(mut ram: Vec<u8>) -> Vec<u8> {
        let mut bytes = Vec::new();
        drain(&mut ram, BASE, &mut bytes);
        if !bytes.is_empty() {
            assert_eq!(ram[40..44], ram[36..40], "the firmware sees that its bytes were read");
        }
        bytes
    }

    #[test]
    fn the_ring_is_read_across_its_end() {
        assert_eq!(taken(ram(5, 2)), [2, 3, 4]);
        assert_eq!(taken(ram(2, 6)), [6, 7, 0, 1]);
        assert_eq!(taken(ram(0, 6)), [6, 7]);
        assert!(taken(ram(3, 3)).is_empty());
    }

    #[test]
    fn a_block_that_is_not_set_up_is_left_alone() {
        assert!(taken(ram(9, 2)).is_empty());
        let mut blank = ram(5, 2);
        blank[0] = 0;
        assert!(taken(blank).is_empty());
        assert!(taken(Vec::new()).is_empty());
    }
}
