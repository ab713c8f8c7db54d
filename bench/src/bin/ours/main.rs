//! Our device with all its services.
#![no_std]
#![no_main]

mod dictionary;
mod driver;
mod node;

use bench_images::Domain;
use core::hint::black_box;
use core::mem::MaybeUninit;

use canopen::dictionary::{Entry, Group};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Condition, Part, Soundness, Stored};
use cortex_m_rt::entry;
use dictionary::DICTIONARY;

/// Two tasks call the device, as in the firmware.
const HALVES: bool = true;

type Measured = canopen::device!(Keeper, dictionary::ROWS);

/// The application: it keeps a domain.
struct Keeper(Domain);

impl Application for Keeper {
    const CONDITIONS: &'static [Condition] = &[Condition::new(0x1000)];
    const SENDS_EVENTS: bool = true;

    fn sends_events(&self, _: u16) -> bool {
        // The optimiser must not know that no TPDO sends events.
        black_box(false)
    }

    fn stored(&self, _: Group) -> Stored<'_> {
        // The optimiser must not know that nothing is ever stored: reading it belongs to the size.
        Stored { packed: black_box(&[]), soundness: black_box(Soundness::Whole) }
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], _: &mut [u8]) -> Result<(), Abort> {
        black_box((entry, bytes));
        Ok(())
    }

    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        Ok(self.0.content())
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        let has_room = match part {
            Part::Begin(_) | Part::End(_) => true,
            Part::Data(offset, bytes) => self.0.write(offset, bytes),
        };
        if has_room { Ok(()) } else { Err(Abort::NotStored) }
    }
}

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<node::Ours> = MaybeUninit::uninit();
    node::run(NODE, Keeper(Domain::new()))
}
