//! The interlocks of the PDO objects: after any writes in any order, no impossible PDO exists, and no PDO changes while
//! it exists (CiA 301, 7.5.2.35 to 38).

use canopen::dictionary::{self, Access, DefaultValue, Dictionary, Mapping, Object, Type};
use canopen::pdo::MappedObject;
use canopen::{CobId, Device, Frame, Instant, NodeId};
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};

use crate::bench::{ID, Nothing, Sent, download};

const PDOS: u16 = 8;

const fn parameter(index: u16, sub: u8, kind: Type) -> Object {
    Object::new(index, sub, "", kind, Access::ReadWrite)
}

const fn communication(index: u16) -> [Object; 6] {
    let invalid = DefaultValue::NodeId(0x8000_0180);
    [
        Object::highest(index, 6, ""),
        parameter(index, 1, Type::Unsigned32).default(invalid),
        parameter(index, 2, Type::Unsigned8).value(255),
        parameter(index, 3, Type::Unsigned16),
        parameter(index, 5, Type::Unsigned16),
        parameter(index, 6, Type::Unsigned8).limits(0, 240),
    ]
}

const fn mapping(index: u16) -> [Object; 9] {
    let mut rows = [parameter(index, 0, Type::Unsigned8).limits(0, 8); 9];
    let mut sub = 1;
    while sub <= 8 {
        rows[sub as usize] = parameter(index, sub, Type::Unsigned32);
        sub += 1;
    }
    rows
}

/// The objects of eight PDOs, `N` rows each.
const fn eight<const N: usize, const ALL: usize>(of: [[Object; N]; 8]) -> [Object; ALL] {
    let mut rows = [of[0][0]; ALL];
    let mut i = 0;
    while i < ALL {
        rows[i] = of[i / N][i % N];
        i += 1;
    }
    rows
}

macro_rules! eight {
    ($part:ident, $rows:literal, $base:literal) => {
        eight::<$rows, { $rows * 8 }>([
            $part($base),
            $part($base + 1),
            $part($base + 2),
            $part($base + 3),
            $part($base + 4),
            $part($base + 5),
            $part($base + 6),
            $part($base + 7),
        ])
    };
}

const fn value(index: u16, kind: Type, mapping: Mapping) -> Object {
    Object::new(index, 0, "", kind, Access::ReadWrite).mappable(mapping)
}

const ROWS: &[&[Object]] = &[
    &[
        Object::new(0x1001, 0, "", Type::Unsigned8, Access::ReadOnly),
        Object::new(0x1005, 0, "", Type::Unsigned32, Access::ReadWrite).value(0x80),
    ],
    &eight!(communication, 6, 0x1400),
    &eight!(mapping, 9, 0x1600),
    &eight!(communication, 6, 0x1800),
    &eight!(mapping, 9, 0x1A00),
    &[
        value(0x2000, Type::Unsigned8, Mapping::No),
        value(0x2001, Type::Unsigned8, Mapping::Tpdo),
        value(0x2002, Type::Integer16, Mapping::Tpdo),
        value(0x2003, Type::Real32, Mapping::Tpdo),
        value(0x2004, Type::Unsigned8, Mapping::Rpdo),
        value(0x2005, Type::Integer16, Mapping::Rpdo),
        value(0x2006, Type::Unsigned32, Mapping::Rpdo),
    ],
];
const COUNT: usize = dictionary::count(ROWS);
static TABLE: [Object; COUNT] = dictionary::gather(ROWS);
const DICTIONARY: Dictionary = canopen::dictionary!(&TABLE);

type Node = canopen::device!(Nothing, &TABLE);

fn node() -> Node {
    let mut device = Device::new(&DICTIONARY, NodeId::new(ID).unwrap(), Nothing);
    let _ = device.start(Instant(0), &mut Sent::default());
    device
}

fn bytes(device: &Node, index: u16, sub: u8) -> Vec<u8> {
    DICTIONARY.find(index, sub).unwrap().field().get(device.image()).to_vec()
}

fn number(device: &Node, index: u16, sub: u8) -> u32 {
    bytes(device, index, sub).iter().rev().fold(0, |n, &byte| n << 8 | u32::from(byte))
}

/// The content of a PDO's objects.
#[derive(Clone, Debug, PartialEq)]
struct Pdo {
    cob_id: u32,
    transmission: u32,
    mapping: Vec<u32>,
}

impl Pdo {
    /// The PDO that the object `index` belongs to.
    fn read(device: &Node, index: u16) -> Pdo {
        let (communication, mapping) = (index & !0x0200, index | 0x0200);
        let count = u8::try_from(number(device, mapping, 0)).unwrap();
        Pdo {
            cob_id: number(device, communication, 1),
            transmission: number(device, communication, 2),
            mapping: (1..=count).map(|sub| number(device, mapping, sub)).collect(),
        }
    }

    fn is_valid(&self) -> bool {
        self.cob_id >> 31 == 0
    }

    fn can_be(&self, is_transmit: bool) -> bool {
        let bits: u32 = self.mapping.iter().map(|entry| entry & 0xFF).sum();
        let free = CobId::parse(self.cob_id).is_some_and(|cob_id| !cob_id.id.is_restricted());
        let known_type = matches!(self.transmission, 0..=240 | 254 | 255)
            || is_transmit && matches!(self.transmission, 252 | 253) && self.cob_id >> 30 & 1 == 0;
        let mappable = self.mapping.iter().all(|&entry| is_mappable(entry, is_transmit));
        free && known_type && mappable && (1..=64).contains(&bits)
    }
}

/// Whether the entry can be mapped: by the rows of the table, and the dummy entries of CiA 301, table 71.
fn is_mappable(entry: u32, is_transmit: bool) -> bool {
    let MappedObject { index, sub, bits } = MappedObject::parse(entry);
    let dummy = matches!((index, bits), (2 | 5, 8) | (3 | 6, 16) | (4 | 7, 32)) && sub == 0;
    let needed = if is_transmit { Mapping::Tpdo } else { Mapping::Rpdo };
    let is_row = |row: &Object| {
        (row.index, row.sub) == (index, sub) && row.mapping == needed && row.kind.size() * 8 == bits
    };
    !is_transmit && dummy || TABLE.iter().any(is_row)
}

#[derive(Clone, Debug)]
struct Write {
    index: u16,
    sub: u8,
    bytes: Vec<u8>,
}

/// A write to an object of one of a few PDOs, with values that are often valid; otherwise no PDO would ever exist.
fn writes(pdos: Vec<u16>) -> impl Strategy<Value = Write> {
    let word = |values: Vec<u32>| prop::sample::select(values).prop_map(|v| v.to_le_bytes().to_vec());
    let cob_ids = vec![0x185, 0x4000_0186, 0x8000_0185, 0x8000_0186, 0xC000_0000, 0x601, 0x2000_0185, 0x7FF];
    let entries = vec![
        0,
        0x2001_0008,
        0x2002_0010,
        0x2003_0020,
        0x2004_0008,
        0x2005_0010,
        0x2006_0020,
        0x0005_0008,
        0x0007_0020,
        0x2000_0008,
        0x2003_0010,
        0x3000_0008,
        0x0005_0108,
    ];
    let transmission = prop_oneof![Just(1), Just(252), Just(253), Just(254), any::<u8>()];
    let content = prop_oneof![
        3 => word(cob_ids).prop_map(|bytes| (0, 1, bytes)),
        1 => any::<u32>().prop_map(|v| (0, 1, v.to_le_bytes().to_vec())),
        1 => transmission.prop_map(|v| (0, 2, vec![v])),
        1 => (prop::sample::select(vec![3, 5]), any::<[u8; 2]>()).prop_map(|(sub, v)| (0, sub, v.to_vec())),
        2 => (0..=9_u8).prop_map(|count| (0x200, 0, vec![count])),
        2 => (0..=1_u8).prop_map(|count| (0x200, 0, vec![count])),
        6 => (1..=4_u8, word(entries)).prop_map(|(sub, bytes)| (0x200, sub, bytes)),
        1 => (1..=8_u8, any::<u32>()).prop_map(|(sub, v)| (0x200, sub, v.to_le_bytes().to_vec())),
    ];
    (prop::sample::select(pdos), content).prop_map(|(pdo, (part, sub, bytes))| Write {
        index: pdo | part,
        sub,
        bytes,
    })
}

/// The five steps that create a PDO.
fn procedure(pdo: u16) -> Vec<Write> {
    let entry: u32 = if pdo & 0x0800 != 0 { 0x2003_0020 } else { 0x2006_0020 };
    let word = |value: u32| value.to_le_bytes().to_vec();
    [
        (0, 1, word(0x8000_0185)),
        (0x200, 0, vec![0]),
        (0x200, 1, word(entry)),
        (0x200, 0, vec![1]),
        (0, 1, word(0x185)),
    ]
    .map(|(part, sub, bytes)| Write { index: pdo | part, sub, bytes })
    .into()
}

/// Two PDOs of any direction and number, and writes to them.
fn sequences() -> impl Strategy<Value = (bool, Vec<Write>)> {
    let pdo = (prop::sample::select(vec![0x1400, 0x1800]), 0..PDOS).prop_map(|(base, number)| base | number);
    let writes = prop::collection::vec(pdo, 2).prop_flat_map(|pdos| {
        let procedures = prop::sample::select(pdos.clone()).prop_map(procedure);
        let single = writes(pdos).prop_map(|write| vec![write]);
        prop::collection::vec(prop_oneof![1 => procedures, 15 => single], 1..80)
    });
    (any::<bool>(), writes.prop_map(|parts| parts.concat()))
}

/// Number of steps that left a PDO valid, and of attempts to change a valid PDO.
#[derive(Default)]
struct Seen {
    valid: usize,
    protected: usize,
}

fn step(device: &mut Node, next: &Write, seen: &mut Seen) -> Result<(), TestCaseError> {
    let (image, before) = (device.image().to_vec(), Pdo::read(device, next.index));
    let is_taken = download(device, (next.index, next.sub), &next.bytes, Instant(0)).is_ok();
    let after = Pdo::read(device, next.index);
    if is_taken {
        prop_assert_eq!(bytes(device, next.index, next.sub), next.bytes.clone());
        // Only this object has changed.
        let field = DICTIONARY.find(next.index, next.sub).unwrap().field();
        let mut expected = image;
        field.set(&mut expected, &next.bytes);
        prop_assert_eq!(device.image(), &expected[..]);
    } else {
        prop_assert_eq!(device.image(), &image[..]);
        seen.protected += usize::from(before.is_valid());
    }
    if after.is_valid() {
        seen.valid += 1;
        prop_assert!(after.can_be(next.index & 0x0800 != 0), "{after:X?}");
    }
    if before.is_valid() && after.is_valid() {
        prop_assert_eq!(before.mapping, after.mapping);
        prop_assert_eq!(before.cob_id & 0x7FF, after.cob_id & 0x7FF);
    }
    Ok(())
}

/// The device listens only to the RPDOs that exist, and to remote frames for the TPDOs that allow them.
fn listens_to_valid_pdos_only(device: &Node) -> Result<(), TestCaseError> {
    let pdos = |base: u16| (base..base + PDOS).map(|index| Pdo::read(device, index)).filter(Pdo::is_valid);
    let asked = pdos(0x1800).filter(|pdo| pdo.cob_id >> 30 == 0);
    let mut expected: Vec<u16> =
        pdos(0x1400).chain(asked).map(|pdo| u16::try_from(pdo.cob_id & 0x7FF).unwrap()).collect();
    expected.extend([0x000, 0x080]);
    let mut actual: Vec<u16> = device.process_ids().map(canopen::CanId::get).collect();
    expected.sort_unstable();
    actual.sort_unstable();
    prop_assert_eq!(actual, expected);
    Ok(())
}

#[test]
fn no_sequence_of_writes_makes_an_invalid_pdo() {
    let cases = 8 * ProptestConfig::default().cases;
    let config = ProptestConfig {
        cases,
        rng_seed: RngSeed::Fixed(1),
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    let seen = std::cell::RefCell::new(Seen::default());
    TestRunner::new(config)
        .run(&sequences(), |(is_operational, sequence)| {
            let mut device = node();
            if is_operational {
                let _ = device.on_process_frame(
                    &Frame::new(0, &[1, 0]).unwrap(),
                    Instant(0),
                    &mut Sent::default(),
                );
            }
            for next in sequence {
                step(&mut device, &next, &mut seen.borrow_mut())?;
                listens_to_valid_pdos_only(&device)?;
            }
            Ok(())
        })
        .unwrap();
    let Seen { valid, protected } = seen.into_inner();
    assert!(valid.min(protected) > 2 * cases as usize, "{valid} and {protected}: the writes never come far");
}
