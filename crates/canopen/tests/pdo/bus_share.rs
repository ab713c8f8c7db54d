//! The share of the bus that a device without other nodes has.

use canopen::dictionary::{Access, Dictionary, Field, Mapping, Object, Type};
use canopen::lss::BitRate;
use canopen::{Frame, Instant, NodeId, QueueFull, Transmit, objects};

use crate::bench::{ID, Nothing, Sent};

const VALUE: Object = Object::new(0x6000, 0, "", Type::Unsigned32, Access::ReadOnly).mappable(Mapping::Tpdo);
const ROWS: &[Object] = canopen::rows!(objects::tpdo(1, &[VALUE]), [VALUE]);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const AT: Field = DICTIONARY.field(0x6000, 0);
/// The longest frame of a TPDO, in bits.
const BITS: u64 = 95;

type Node = canopen::device!(Nothing, ROWS);

/// A queue in front of a bus without other nodes. Frames wait until the bus has sent all before them.
struct Bus {
    kbit: u64,
    now: u64,
    free_at: u64,
    sent: u64,
}

impl Transmit for Bus {
    fn send(&mut self, _: Frame) -> Result<(), QueueFull> {
        self.free_at = self.free_at.max(self.now) + BITS * 1000 / self.kbit;
        self.sent += 1;
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }

    fn has_waiting_pdo(&self) -> bool {
        self.now < self.free_at
    }
}

/// A PDO that waits behind others of the same device does not show that other nodes hold the bus.
#[test]
fn a_device_alone_on_the_bus_has_three_quarters_of_it_for_its_pdos() {
    for kbit in [10, 125] {
        let mut device = Node::new(&DICTIONARY, NodeId::new(ID), Nothing);
        let _ = device.start(Instant(0), &mut Sent::default());
        let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(0), &mut Sent::default());
        device.set_bus_bit_rate(BitRate::from_kbit(kbit).unwrap());
        let mut bus = Bus { kbit: kbit.into(), now: 0, free_at: 0, sent: 0 };
        for number in 1..=5_000 {
            bus.now += 200;
            let now = Instant(bus.now);
            let _ = device.publish(now, &mut bus, |_, image| AT.set_u32(image, number));
            let _ = device.poll(now, &mut bus);
        }
        let (bits, may) = (bus.sent * BITS, u64::from(kbit) * 750);
        assert!((may * 9 / 10..=may * 11 / 10).contains(&bits), "{kbit} kbit/s: {bits} bits in a second");
    }
}
