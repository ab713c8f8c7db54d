//! Writes to entries that the application handles.

use canopen::dictionary::{Access, Dictionary, Entry, Field, Mapping, Object, Type};
use canopen::sdo::Abort;
use canopen::{Application, Device, Frame, Instant, NodeId, objects};
use std::cell::Cell;

use crate::bench::{ID, Nothing, Sent, download};

const VALUE: Object =
    Object::new(0x6000, 0, "", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo).value(9);
const ROWS: &[Object] = canopen::rows!(
    [objects::device_type(0)],
    objects::identity(0, 1, 1),
    objects::tpdo(1, &[VALUE]),
    [
        Object::new(0x2010, 0, "Value", Type::Unsigned8, Access::ReadWrite).handled(),
        Object::new(0x2011, 0, "TPDO 1 is on", Type::Unsigned8, Access::ReadWrite).handled(),
        VALUE
    ],
);
static DICTIONARY: Dictionary = canopen::dictionary!(ROWS);
const COB_ID: Field = DICTIONARY.field(0x1800, 1);

/// Counts how often the device reads the settings of TPDO 1, and switches it by 2011h.
#[derive(Default)]
struct Switch(Cell<u32>);

impl Application for Switch {
    const SENDS_EVENTS: bool = true;

    fn sends_events(&self, _: u16) -> bool {
        self.0.set(self.0.get() + 1);
        false
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        if entry.index() == 0x2011 {
            let off = if bytes == [0] { 1 << 31 } else { 0 };
            COB_ID.store(image, ((u32::from(ID) + 0x180) | off).to_le_bytes());
        }
        Ok(())
    }

    fn switches_pdos(&self, entry: &Entry) -> bool {
        entry.index() == 0x2011
    }
}

fn operational() -> (canopen::device!(Switch, ROWS), Sent) {
    let (mut device, mut sent) =
        (Device::new(&DICTIONARY, NodeId::new(ID), Switch::default()), Sent::default());
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    sent.0.clear();
    (device, sent)
}

#[test]
fn a_handled_write_leaves_the_pdos_alone() {
    let (mut device, _) = operational();
    let before = device.application().0.get();
    let (due, now) = (device.poll_process(Instant(2), &mut Sent::default()).process, Instant(2));
    assert_eq!(download(&mut device, (0x2010, 0), &[1], now), Ok(()));
    assert_eq!(device.application().0.get(), before, "the settings of TPDO 1 are not read");
    assert_eq!(device.poll_process(now, &mut Sent::default()).process, due);
}

#[test]
fn a_handled_write_switches_a_pdo_at_once() {
    let (mut device, mut sent) = operational();
    assert_eq!(download(&mut device, (0x2011, 0), &[0], Instant(2)), Ok(()));
    let mut frames = |device: &mut canopen::device!(Switch, ROWS), now| {
        sent.0.clear();
        let _ = device.send_tpdo(1, Instant(now), &mut sent);
        sent.0.len()
    };
    assert_eq!(frames(&mut device, 1_000_000), 0, "TPDO 1 is off");
    assert_eq!(download(&mut device, (0x2011, 0), &[1], Instant(2_000_000)), Ok(()));
    assert_eq!(frames(&mut device, 3_000_000), 1, "TPDO 1 is on");
}

/// Reading the settings of all PDOs takes time, so an application has to ask for it.
#[test]
fn an_application_switches_no_pdo_by_default() {
    let mut device: canopen::device!(Nothing, ROWS) = Device::new(&DICTIONARY, NodeId::new(ID), Nothing);
    let mut sent = Sent::default();
    let _ = device.start(Instant(0), &mut sent);
    let _ = device.on_frame(&Frame::new(0, &[1, ID]).unwrap(), Instant(1), &mut sent);
    device.show(|_, image| COB_ID.store(image, (1_u32 << 31 | 0x185).to_le_bytes()));
    assert_eq!(download(&mut device, (0x2010, 0), &[1], Instant(2)), Ok(()));
    sent.0.clear();
    let _ = device.send_tpdo(1, Instant(1_000_000), &mut sent);
    assert_eq!(sent.0.len(), 1, "TPDO 1 is on");
}
