//! The registers between the program and this process. `bench/src/registers.rs` holds the program's side, at the same
//! addresses.

use canbus::Time;
use canopen::Frame;
use chip::{BusFault, Effect, IrqLines, Memory, Peripherals};

/// The task of the program; the program reads the number from a register.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Command {
    /// The empty loop.
    #[default]
    Nothing = 0,
    /// Time has passed and no frame has come.
    Pass = 1,
    /// A frame, processed up to the point where the node knows whether the frame is for the node.
    Sort = 2,
    /// NMT, SYNC or RPDO.
    Process = 3,
    /// Any other frame.
    Serve = 4,
}

/// A request to the program.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Request {
    pub(crate) command: Command,
    /// Microseconds since start-up.
    pub(crate) now: u64,
    pub(crate) frame: Option<Frame>,
}

impl Request {
    fn word(&self, offset: u32) -> Option<u32> {
        let data = || self.frame.map_or(0, |frame| word_of(&frame));
        Some(match offset {
            0x00 => self.command as u32,
            0x04 => self.now as u32,
            0x08 => (self.now >> 32) as u32,
            0x10 => self.frame.map_or(0, |frame| frame.id().into()),
            0x14 => self.frame.map_or(0, |frame| frame.len() as u32),
            0x18 => data() as u32,
            0x1C => (data() >> 32) as u32,
            _ => return None,
        })
    }
}

fn word_of(frame: &Frame) -> u64 {
    let mut bytes = [0; 8];
    bytes[..frame.len()].copy_from_slice(frame.data());
    u64::from_le_bytes(bytes)
}

/// The registers: the request, and the values that the program has written.
#[derive(Default)]
pub(crate) struct Mailbox {
    pub(crate) request: Request,
    /// Instructions are being counted.
    pub(crate) counts: bool,
    pub(crate) is_done: bool,
    pub(crate) has_panicked: bool,
    /// Frames for the bus, in their order.
    pub(crate) sent: Vec<Frame>,
    /// Data and length of the frame that is being written.
    words: [u32; 3],
    poke: bool,
}

impl Mailbox {
    fn take_frame(&mut self, id: u32) -> Option<()> {
        let [len, low, high] = self.words;
        let data = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
        self.sent.push(Frame::new(id as u16, data.get(..len as usize)?)?);
        Some(())
    }

    fn store(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            0x20 => return self.take_frame(value),
            0x24..=0x2C => self.words[(offset as usize - 0x24) / 4] = value,
            0x40 => self.counts = value != 0,
            0x44 => self.is_done = true,
            0x48 => self.has_panicked = true,
            _ => return None,
        }
        // The machine stops before its next block, so that the caller sees the change of the count or the end.
        self.poke |= offset >= 0x40;
        Some(())
    }
}

impl Peripherals for Mailbox {
    fn read(&mut self, address: u32, _: u8, _: Time) -> Result<u32, BusFault> {
        match address - 0x4000_0000 {
            // The bus always has room for a frame.
            0x30 => Ok(1),
            offset => self.request.word(offset).ok_or(BusFault),
        }
    }

    fn write(&mut self, address: u32, _: u8, value: u32, _: Time) -> Result<(), BusFault> {
        self.store(address - 0x4000_0000, value).ok_or(BusFault)
    }

    fn program(&mut self, _: u32, _: &[u8], _: &[u8], _: Time) -> Result<(), BusFault> {
        Err(BusFault)
    }

    fn deadline(&self) -> Time {
        Time::NEVER
    }

    fn advance(&mut self, _: Time, _: &dyn Memory) {}

    fn lines(&self) -> IrqLines {
        IrqLines::default()
    }

    fn effect(&mut self) -> Option<Effect> {
        std::mem::take(&mut self.poke).then_some(Effect::Poke)
    }

    fn reset(&mut self, _: bool, _: Time) {}
}
