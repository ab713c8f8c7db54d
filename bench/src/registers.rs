//! The registers between the program and the host. `emulator/workbench` has the other side, at the same addresses.

use core::ptr;
use core::sync::atomic::{Ordering, compiler_fence};

use crate::Bits;

/// Start of the registers; nothing else is there.
const BASE: usize = 0x4000_0000;

/// The request, read by the program.
const COMMAND: usize = BASE;
const NOW: [usize; 2] = [BASE + 0x04, BASE + 0x08];
const RECEIVED: usize = BASE + 0x10;
/// A frame for the bus; its identifier is written last.
const SENT: usize = BASE + 0x20;
/// Whether the frame was taken.
const TAKEN: usize = BASE + 0x30;
/// Writing 1 starts the count, 0 stops it.
const COUNT: usize = BASE + 0x40;
/// Any write: the request is done.
const DONE: usize = BASE + 0x44;
/// Any write: the program has panicked.
const PANICKED: usize = BASE + 0x48;

/// Commands of the host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Command {
    /// The empty loop, which is subtracted from the others.
    Nothing,
    /// [`Node::pass`](crate::Node::pass).
    Pass,
    /// [`Node::sort`](crate::Node::sort).
    Sort,
    /// [`Node::process`](crate::Node::process).
    Process,
    /// [`Node::serve`](crate::Node::serve).
    Serve,
    /// [`Node::disturb`](crate::Node::disturb).
    Disturb,
}

/// A request of the host.
#[derive(Clone, Copy, Debug)]
pub struct Request {
    /// The command.
    pub command: Command,
    /// Time in microseconds.
    pub now: u64,
    /// The frame; meaningless if the command needs none.
    pub frame: Bits,
}

/// The next request.
#[must_use]
pub fn request() -> Request {
    let command = match read(COMMAND) {
        1 => Command::Pass,
        2 => Command::Sort,
        3 => Command::Process,
        4 => Command::Serve,
        5 => Command::Disturb,
        _ => Command::Nothing,
    };
    let [low, high] = NOW.map(read);
    Request { command, now: u64::from(high) << 32 | u64::from(low), frame: received() }
}

fn received() -> Bits {
    let [id, len, low, high] = [0, 4, 8, 12].map(|offset| read(RECEIVED + offset));
    let data = (u64::from(high) << 32 | u64::from(low)).to_le_bytes();
    Bits { id: id as u16, len: len as usize, data }
}

/// Puts a frame on the bus; returns whether there was room.
pub(crate) fn transmit(frame: Bits) -> bool {
    let [a, b, c, d, e, f, g, h] = frame.data;
    write(SENT + 12, u32::from_le_bytes([e, f, g, h]));
    write(SENT + 8, u32::from_le_bytes([a, b, c, d]));
    write(SENT + 4, frame.len as u32);
    write(SENT, frame.id.into());
    read(TAKEN) != 0
}

/// Starts or stops the count. A function of its own, so that it ends a block of code: the emulator counts by blocks, so
/// the count begins and ends with the return from this function.
#[inline(never)]
pub(crate) fn count(runs: bool) {
    compiler_fence(Ordering::SeqCst);
    write(COUNT, runs.into());
    compiler_fence(Ordering::SeqCst);
}

#[inline(never)]
pub(crate) fn done() {
    write(DONE, 1);
}

pub(crate) fn panicked() {
    write(PANICKED, 1);
}

fn read(address: usize) -> u32 {
    // SAFETY: the machine that runs these programs has a register at each of the addresses above.
    unsafe { ptr::with_exposed_provenance::<u32>(address).read_volatile() }
}

fn write(address: usize, value: u32) {
    // SAFETY: as in `read`; no memory of the program lies there.
    unsafe { ptr::with_exposed_provenance_mut::<u32>(address).write_volatile(value) }
}
