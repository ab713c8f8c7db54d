//! A gateway with all that CiA 301 allows, from const rows and with the public API alone: 512 PDOs in each direction, and
//! 127 monitored nodes. Its dictionary is compiled with this test: `cargo build --timings` shows how long that takes.

#![allow(clippy::large_const_arrays, reason = "only the compiler evaluates the rows")]

use canopen::dictionary::{Access, Dictionary, Mapping, Object, Type};
use canopen::{Device, Frame, Instant, NodeId, QueueFull, Transmit, objects};

const PDOS: usize = 512;

/// UNSIGNED32 values, one object each.
const fn values(first: u16, access: Access, mapping: Mapping) -> [[Object; 1]; PDOS] {
    let mut rows = [[Object::new(first, 0, "Value", Type::Unsigned32, access).mappable(mapping)]; PDOS];
    let mut n = 0;
    while n < PDOS {
        rows[n][0].index = first + n as u16;
        n += 1;
    }
    rows
}

const SENT: [[Object; 1]; PDOS] = values(0x2000, Access::ReadOnly, Mapping::Tpdo);
const RECEIVED: [[Object; 1]; PDOS] = values(0x3000, Access::ReadWrite, Mapping::Rpdo);
const TPDOS: [[Object; 15]; PDOS] = objects::tpdos(1, &SENT);
const RPDOS: [[Object; 13]; PDOS] = objects::rpdos(1, &RECEIVED);

#[allow(long_running_const_eval)]
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0), objects::error_register()],
    objects::emergency(),
    objects::heartbeat_consumer::<128>(),
    [objects::heartbeat_producer(1000)],
    objects::identity(0, 1, 1),
    TPDOS.as_flattened(),
    RPDOS.as_flattened(),
    SENT.as_flattened(),
    RECEIVED.as_flattened(),
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);

const ID: u8 = 5;

#[derive(Default)]
struct Sent(Vec<Frame>);

impl Transmit for Sent {
    fn send(&mut self, frame: Frame) -> Result<(), QueueFull> {
        self.0.push(frame);
        Ok(())
    }

    fn room(&self) -> usize {
        usize::MAX
    }
}

#[test]
fn the_last_pdos_and_the_last_monitored_node_work() {
    let mut sent = Sent::default();
    let mut gateway: Box<canopen::device!((), ROWS)> =
        Box::new(Device::new(&DICTIONARY, NodeId::new(ID), ()));
    let _ = gateway.start(Instant(0), &mut sent);
    let mut write = |index: u16, sub: u8, value: u32| {
        let [low, high] = index.to_le_bytes();
        let [a, b, c, d] = value.to_le_bytes();
        let request = Frame::new(0x600 + u16::from(ID), &[0x23, low, high, sub, a, b, c, d]).unwrap();
        let mut answer = Sent::default();
        let _ = gateway.on_frame(&request, Instant(1), &mut answer);
        assert_eq!(answer.0[0].data()[0], 0x60, "{index:X}h:{sub}: {:?}", answer.0);
    };
    write(0x19FF, 1, 0x695);
    write(0x15FF, 1, 0x6AB);
    write(0x1016, 127, 0x007F_0064);
    let _ = gateway.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(2), &mut sent);
    sent.0.clear();
    let field = DICTIONARY.field(0x21FF, 0);
    let _ = gateway.publish(Instant(3), &mut sent, |(), image| field.set_u32(image, 7));
    let last = sent.0.iter().find(|frame| frame.id() == 0x695).map(Frame::data);
    assert_eq!(last, Some(&[7, 0, 0, 0][..]), "TPDO 512");
    let _ = gateway.on_frame(&Frame::new(0x6AB, &[9, 0, 0, 0]).unwrap(), Instant(4), &mut sent);
    assert_eq!(DICTIONARY.field(0x31FF, 0).u32(gateway.image()), 9, "RPDO 512");
    let _ = gateway.on_frame(&Frame::new(0x77F, &[5]).unwrap(), Instant(5), &mut sent);
    assert_eq!(gateway.state_of(NodeId::new(127).unwrap()), Some(canopen::nmt::State::Operational));
}
