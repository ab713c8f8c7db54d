//! What the programs share: how the host makes them do one operation and counts it.
//!
//! The host is the bus and the client. Each request is a command and a frame in registers that the emulated machine
//! has in place of peripherals. The count runs from the frame in the node's own type to the frame handed to the
//! driver: it stands still while the driver has a frame, so the driver of one node is no cheaper than that of another.
#![no_std]

mod domain;
pub mod registers;

use core::hint::black_box;

pub use domain::Domain;
use registers::{Command, Request};

/// A frame on its way between the node's own type and the registers.
#[derive(Clone, Copy, Debug)]
pub struct Bits {
    /// The CAN-ID.
    pub id: u16,
    /// Data length code.
    pub len: usize,
    /// The data, then anything.
    pub data: [u8; 8],
}

/// Something to be measured. Times are microseconds since start-up.
pub trait Node {
    /// Its type of a frame.
    type Frame: From<Bits>;

    /// Time has passed, nothing has come.
    fn pass(&mut self, now: u64);

    /// A frame that may be anybody's, up to the point where it is known for whom it is.
    fn sort(&mut self, frame: &Self::Frame, now: u64);

    /// NMT, SYNC or RPDO, up to the next deadline.
    fn process(&mut self, frame: &Self::Frame, now: u64);

    /// Any other frame of this node, up to the next deadline.
    fn serve(&mut self, frame: &Self::Frame, now: u64);

    /// The application reports a fault and changes values. Not measured: it is here to be part of the size.
    fn disturb(&mut self, now: u64);
}

/// Does what the host asks for.
pub fn run<N: Node>(node: &mut N) -> ! {
    loop {
        let Request { command, now, frame } = registers::request();
        let frame = N::Frame::from(frame);
        let (node, frame) = black_box((&mut *node, &frame));
        registers::count(true);
        match command {
            Command::Nothing => (),
            Command::Pass => node.pass(now),
            Command::Sort => node.sort(frame, now),
            Command::Process => node.process(frame, now),
            Command::Serve => node.serve(frame, now),
            Command::Disturb => node.disturb(now),
        }
        registers::count(false);
        registers::done();
    }
}

/// The driver: takes a frame. `bits` makes it fit the registers; that is not counted.
#[inline(never)]
pub fn transmit<F>(frame: &F, bits: impl FnOnce(&F) -> Bits) -> bool {
    registers::count(false);
    let is_taken = registers::transmit(bits(frame));
    registers::count(true);
    is_taken
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    registers::panicked();
    loop {
        core::hint::spin_loop();
    }
}
