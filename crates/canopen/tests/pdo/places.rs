//! PDOs with numbers chosen by the dictionary, and PDOs with CAN-IDs fixed by a profile.

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Mapping, Object, Type};
use canopen::{Device, Frame, Instant, NodeId};

use crate::bench::{ID, Nothing, Sent, download};

const NOW: Instant = Instant(1_000_000);

const fn cob_id(index: u16, default: DefaultValue) -> [Object; 3] {
    [
        Object::highest(index, 2, ""),
        Object::new(index, 1, "", Type::Unsigned32, Access::ReadWrite).default(default),
        Object::new(index, 2, "", Type::Unsigned8, Access::ReadWrite).value(255),
    ]
}

/// A COB-ID with a fixed CAN-ID.
const fn predefined(index: u16, default: DefaultValue) -> [Object; 3] {
    let [highest, cob_id, transmission] = cob_id(index, default);
    [highest, cob_id.predefined(), transmission]
}

/// A mapping that never changes.
const fn mapping(index: u16, mapped: i64) -> [Object; 2] {
    [
        Object::new(index, 0, "", Type::Unsigned8, Access::Const).value(1),
        Object::new(index, 1, "", Type::Unsigned32, Access::Const).value(mapped),
    ]
}

const fn value(index: u16, access: Access, mapping: Mapping) -> Object {
    Object::new(index, 0, "", Type::Unsigned16, access).mappable(mapping)
}

/// RPDOs 7 and 512, TPDOs 2 (multiplexed), 130, 261 and 512. All but the last have a fixed CAN-ID.
const PARTS: &[&[Object]] = &[
    &predefined(0x1406, DefaultValue::Integer(0x206)),
    &predefined(0x15FF, DefaultValue::Integer(0x180)),
    &mapping(0x1606, 0x2004_0010),
    &mapping(0x17FF, 0x2005_0010),
    &predefined(0x1801, DefaultValue::NodeId(0x500)),
    &predefined(0x1881, DefaultValue::NodeId(0x4000_0480)),
    &predefined(0x1904, DefaultValue::Integer(0x4000_0180)),
    &cob_id(0x19FF, DefaultValue::Integer(0x8000_0000)),
    &[Object::new(0x1A01, 0, "", Type::Unsigned8, Access::Const).value(0xFF)],
    &mapping(0x1A81, 0x2001_0010),
    &mapping(0x1B04, 0x2002_0010),
    &mapping(0x1BFF, 0x2003_0010),
    &[
        value(0x2001, Access::ReadOnly, Mapping::Tpdo),
        value(0x2002, Access::ReadOnly, Mapping::Tpdo),
        value(0x2003, Access::ReadOnly, Mapping::Tpdo),
        value(0x2004, Access::ReadWrite, Mapping::Rpdo),
        value(0x2005, Access::ReadWrite, Mapping::Rpdo),
        value(0x2006, Access::ReadOnly, Mapping::Tpdo),
    ],
];
static TABLE: [Object; dictionary::count(PARTS)] = dictionary::gather(PARTS);
const DICTIONARY: Dictionary = canopen::dictionary!(&TABLE);

struct Bench {
    device: canopen::device!(Nothing, &TABLE),
    sent: Sent,
}

impl Bench {
    fn operational() -> Bench {
        let device = Device::new(&DICTIONARY, NodeId::new(ID), Nothing);
        let mut bench = Bench { device, sent: Sent::default() };
        let _ = bench.device.start(NOW, &mut bench.sent);
        bench.sent.0.clear();
        bench.receive(&Frame::new(0, &[1, ID]).unwrap());
        bench
    }

    fn receive(&mut self, frame: &Frame) {
        let _ = self.device.on_frame(frame, NOW, &mut self.sent);
        let _ = self.device.poll_process(NOW, &mut self.sent);
    }

    fn ids(&mut self) -> Vec<u16> {
        self.sent.0.drain(..).map(|frame| frame.id()).collect()
    }

    /// Changes one of the values and returns the CAN-IDs sent.
    fn change(&mut self, index: u16) -> Vec<u16> {
        self.ids();
        let field = DICTIONARY.field(index, 0);
        let changed = field.u16(self.device.image()).wrapping_add(1);
        let _ =
            self.device.publish(NOW, &mut self.sent, |_, image| field.store(image, changed.to_le_bytes()));
        self.ids()
    }

    fn write_cob_id(&mut self, index: u16, value: u32) -> Result<(), u32> {
        let result = download(&mut self.device, (index, 1), &value.to_le_bytes(), NOW);
        let _ = self.device.poll_process(NOW, &mut self.sent);
        result
    }
}

const INVALID_VALUE: u32 = 0x0609_0030;

#[test]
fn every_number_is_a_pdo_of_its_own() {
    let mut bench = Bench::operational();
    assert_eq!(bench.ids(), [0x485, 0x180, 0x505], "those that are valid, on entering Operational");
    assert_eq!(bench.change(0x2001), [0x485]);
    assert_eq!(bench.change(0x2002), [0x180]);
    assert_eq!(bench.change(0x2003), []);
    bench.write_cob_id(0x19FF, 0x385).unwrap();
    assert_eq!(bench.change(0x2003), [0x385]);
    bench.write_cob_id(0x1904, 0xC000_0180).unwrap();
    assert_eq!((bench.change(0x2002), bench.change(0x2001)), (vec![], vec![0x485]));
}

#[test]
fn the_multiplexed_pdo_has_all_unmapped_objects() {
    let mut bench = Bench::operational();
    assert_eq!((bench.change(0x2006), bench.change(0x2003)), (vec![0x505], vec![]));
    bench.write_cob_id(0x1904, 0xC000_0180).unwrap();
    assert_eq!(bench.change(0x2002), [], "though its own PDO is off");
}

#[test]
fn receive_pdos_go_where_their_mapping_says() {
    let mut bench = Bench::operational();
    let values =
        |bench: &Bench| [0x2004, 0x2005].map(|index| DICTIONARY.field(index, 0).u16(bench.device.image()));
    assert!([0x206, 0x180].iter().all(|&id| bench.device.process_ids().any(|other| other.get() == id)));
    bench.receive(&Frame::new(0x180, &[7, 0]).unwrap());
    assert_eq!(values(&bench), [0, 7]);
    bench.receive(&Frame::new(0x206, &[9, 0]).unwrap());
    assert_eq!(values(&bench), [9, 7]);
    bench.write_cob_id(0x1406, 0x8000_0206).unwrap();
    bench.receive(&Frame::new(0x206, &[1, 0]).unwrap());
    bench.receive(&Frame::new(0x180, &[2, 0]).unwrap());
    assert_eq!(values(&bench), [9, 2]);
}

#[test]
fn a_pre_defined_pdo_changes_its_flags_and_nothing_else() {
    let mut bench = Bench::operational();
    for (index, value, result) in [
        (0x1904, 0x4000_0181, Err(INVALID_VALUE)),
        (0x1904, 0x8000_0181, Err(INVALID_VALUE)),
        (0x1904, 0x8000_0180, Ok(())),
        (0x1904, 0x8000_0181, Err(INVALID_VALUE)),
        (0x1904, 0x0000_0180, Ok(())),
        // The default of this COB-ID includes the node-ID.
        (0x1881, 0xC000_0480, Err(INVALID_VALUE)),
        (0x1881, 0xC000_0485, Ok(())),
        (0x1881, 0x0000_0485, Ok(())),
        // Other PDOs must not use the CAN-IDs that CiA 301 restricts.
        (0x19FF, 0x0000_0180, Err(INVALID_VALUE)),
        (0x19FF, 0x0000_0181, Ok(())),
    ] {
        assert_eq!(bench.write_cob_id(index, value), result, "{index:X}h = {value:X}h");
    }
}
