//! Common parts of the programs: the host makes a program do one operation and counts its instructions.
//!
//! The host is the bus and the client. Each request is a command and a frame in registers, which the emulated machine
//! has in place of peripherals. The count runs from the frame in the node's own type to the frame given to the driver.
//! The counter is stopped while the driver has a frame, so the cost of the driver is the same for all nodes.
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
    /// The data; bytes beyond the length are undefined.
    pub data: [u8; 8],
}

/// A node to be measured. Times are microseconds since start-up.
pub trait Node {
    /// The node's type for a frame.
    type Frame: From<Bits>;

    /// Time has passed without a frame.
    fn pass(&mut self, now: u64);

    /// A frame that may be for any node, up to the point where its receiver is known.
    fn sort(&mut self, frame: &Self::Frame, now: u64);

    /// NMT, SYNC or RPDO, up to the next deadline.
    fn process(&mut self, frame: &Self::Frame, now: u64);

    /// Any other frame of this node, up to the next deadline.
    fn serve(&mut self, frame: &Self::Frame, now: u64);

    /// The application reports a fault and changes values. Not measured: only part of the program's size.
    fn disturb(&mut self, now: u64);
}

/// Carries out the host's requests.
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

/// The driver: takes a frame. `bits` converts the frame for the registers; the conversion is not counted.
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
