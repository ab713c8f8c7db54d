//! The empty program, whose size is subtracted from the sizes of the others.
#![no_std]
#![no_main]

use bench_images::{Bits, Domain, Node, transmit};
use cortex_m_rt::entry;

/// Only the parts that every program has around its node: a driver, and the content of a domain.
struct Empty(Domain);

/// A frame in the form of the registers.
struct Raw(Bits);

impl From<Bits> for Raw {
    fn from(bits: Bits) -> Raw {
        Raw(bits)
    }
}

impl Empty {
    fn echo(&mut self, frame: &Raw) {
        // The length is not constant, so the compiler calls `memcpy`, as every program does for its domain and its node.
        self.0.write(0, frame.0.data.get(..frame.0.len).unwrap_or(&[]));
        transmit(frame, |frame| frame.0);
    }
}

impl Node for Empty {
    type Frame = Raw;

    fn pass(&mut self, _: u64) {}

    fn sort(&mut self, frame: &Raw, _: u64) {
        self.echo(frame);
    }

    fn process(&mut self, frame: &Raw, _: u64) {
        self.echo(frame);
    }

    fn serve(&mut self, frame: &Raw, _: u64) {
        self.echo(frame);
    }

    fn disturb(&mut self, _: u64) {}
}

#[entry]
fn main() -> ! {
    static mut NODE: Empty = Empty(Domain::new());
    bench_images::run(NODE)
}
