//! Our device, called as the firmware calls it: one task for process data and one for services, each asks for its next
//! deadline at its end.
#![no_std]
#![no_main]

mod dictionary;

use bench_images::{Bits, Domain, Node, transmit};
use core::hint::black_box;
use core::mem::MaybeUninit;

use canopen::dictionary::Group;
use canopen::sdo::{Abort, Multiplexer};
use canopen::{
    Action, Application, BusEvent, CanId, Condition, Device, Frame, Instant, Next, NodeId, Part, QueueFull,
    Soundness, Stored, Transmit,
};
use cortex_m_rt::entry;

/// The node-ID that the host talks to.
const ID: u8 = 1;

/// The application: it keeps a domain.
struct Keeper(Domain);

impl Application for Keeper {
    const CONDITIONS: &'static [Condition] = &[Condition::new(0x1000)];

    fn stored(&self, _: Group) -> Stored<'_> {
        // The optimiser must not know that nothing is ever stored: reading it belongs to the size.
        Stored { packed: black_box(&[]), soundness: black_box(Soundness::Whole) }
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

/// A queue of which the optimiser knows nothing.
struct Driver {
    room: usize,
}

impl Transmit for Driver {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        if transmit(&frame, bits) { Ok(()) } else { Err(QueueFull) }
    }

    fn room(&self) -> usize {
        self.room
    }
}

fn bits(frame: &Frame) -> Bits {
    let mut data = [0; 8];
    for (to, from) in data.iter_mut().zip(frame.data()) {
        *to = *from;
    }
    Bits { id: frame.id(), len: frame.len(), data }
}

/// A received frame.
struct Received(Frame);

impl From<Bits> for Received {
    fn from(bits: Bits) -> Received {
        let data = bits.data.get(..bits.len).unwrap_or(&[]);
        Received(Frame::new(bits.id, data).expect("the host sends valid frames"))
    }
}

struct Ours {
    device: canopen::device!(Keeper, dictionary::ROWS),
    driver: Driver,
    /// When each half wants to be called, as the firmware keeps it.
    alarms: [Instant; 2],
}

impl Node for Ours {
    type Frame = Received;

    fn pass(&mut self, now: u64) {
        let mut next = self.device.poll(Instant(now), &mut self.driver);
        while let Some(action) = next.action {
            next = self.fulfil(action, Instant(now));
        }
    }

    fn disturb(&mut self, now: u64) {
        let _ = self.device.set_condition(0, true, Instant(now));
        let _ = self.device.on_bus(BusEvent::Overrun, Instant(now));
        let _ = self.device.publish(Instant(now), &mut self.driver, |_, image| image.fill(0));
        let _ = self.device.set_condition(0, false, Instant(now));
    }

    fn sort(&mut self, Received(frame): &Received, now: u64) {
        let _ = self.device.on_frame(frame, Instant(now), &mut self.driver);
    }

    fn process(&mut self, Received(frame): &Received, now: u64) {
        let next = self.device.on_process_frame(frame, Instant(now), &mut self.driver);
        self.alarms[0] = next.process;
    }

    fn serve(&mut self, Received(frame): &Received, now: u64) {
        let next = self.device.on_service_frame(frame, Instant(now), &mut self.driver);
        self.alarms[1] = next.services;
    }
}

impl Ours {
    fn new() -> Ours {
        Ours {
            device: Device::new(&dictionary::DICTIONARY, NodeId::new(ID), Keeper(Domain::new())),
            driver: Driver { room: black_box(usize::MAX) },
            alarms: [Instant(0); 2],
        }
    }

    /// Does what the device leaves to its caller.
    fn fulfil(&mut self, action: Action, now: Instant) -> Next {
        match action {
            Action::ResetNode | Action::ResetCommunication => {
                return self.device.start(now, &mut self.driver);
            }
            Action::Identifiers => {
                let ids = self.device.process_ids().chain(self.device.service_ids());
                black_box(ids.map(CanId::get).fold(0, u16::wrapping_add));
            }
            Action::Store(_) => return self.device.finish(Ok(()), now, &mut self.driver),
            Action::BitRate(_) | Action::Bootloader => (),
        }
        self.device.poll(now, &mut self.driver)
    }
}

#[entry]
fn main() -> ! {
    static mut NODE: MaybeUninit<Ours> = MaybeUninit::uninit();
    let node = NODE.write(Ours::new());
    let _ = node.device.start(Instant(0), &mut node.driver);
    bench_images::run(node)
}
