//! Every row of tables/emcy.csv on the running node: the fault, its EMCY message, 1003h, 1001h and its flag in 3000h.
//! The node is the combined one, which has all faults. Codes without a fault are never sent; the table gives the
//! reason.

use std::collections::BTreeSet;

use canopen::dictionary::Group;
use canopen::{Condition, Frame};
use host_tests::bench::{Bench, ID, raw};
use node::{BusEvent, FAULTS, Fault, Personality};
use profiles::board::{Board, RawSample};

const TABLE: &str = include_str!("../../tables/emcy.csv");
/// The number of mapped objects that selects a multiplexed PDO with a destination.
const MULTIPLEXED: u8 = 255;
const EMCY: u16 = 0x080 + ID as u16;

#[derive(Debug)]
struct Row {
    code: u16,
    flag: Option<(u16, u8, u32)>,
    fault: Option<Any>,
    remark: &'static str,
}

fn rows() -> impl Iterator<Item = Row> {
    TABLE.lines().skip(1).map(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        let &[code, _meaning, index, sub, bit, fault, remark] = &cells[..] else { panic!("{line}") };
        let hex = |text: &str| u16::from_str_radix(text.trim_start_matches("0x"), 16).unwrap();
        let flag = (!index.is_empty()).then(|| (hex(index), sub.parse().unwrap(), bit.parse().unwrap()));
        let fault = (!fault.is_empty()).then(|| named(fault));
        Row { code: hex(code), flag, fault, remark }
    })
}

/// A fault of the node or of communication, by its name in the table.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Any {
    Node(Fault),
    Bus(canopen::Fault),
}

impl Any {
    fn all() -> impl Iterator<Item = Any> {
        use canopen::Fault as Bus;
        let bus = [
            Bus::Overrun,
            Bus::ErrorPassive,
            Bus::BusOffRecovered,
            Bus::SyncMissing,
            Bus::SyncLength,
            Bus::MpdoNotTaken,
            Bus::Heartbeat(0),
            Bus::RpdoTooShort(1),
            Bus::RpdoTooLong(1),
            Bus::RpdoDeadline(1),
            Bus::StoredData(Group::Communication),
            Bus::StoredData(Group::Application),
            Bus::StoredData(Group::Calibration),
            Bus::OlderData(Group::Communication),
            Bus::OlderData(Group::Application),
            Bus::OlderData(Group::Calibration),
        ];
        FAULTS.into_iter().map(Any::Node).chain(bus.into_iter().map(Any::Bus))
    }

    fn name(self) -> String {
        match self {
            Any::Node(fault) => fault.name.into(),
            Any::Bus(canopen::Fault::StoredData(group)) => format!("{group:?}Data"),
            Any::Bus(canopen::Fault::OlderData(group)) => format!("Older{group:?}Data"),
            Any::Bus(fault) => format!("{fault:?}"),
        }
    }

    fn condition(self) -> Condition {
        match self {
            Any::Node(fault) => fault.condition,
            Any::Bus(fault) => fault.condition(&[]),
        }
    }

    fn code(self) -> u16 {
        self.condition().code
    }
}

fn named(name: &str) -> Any {
    Any::all().find(|fault| fault.name() == name).unwrap_or_else(|| panic!("no fault {name}"))
}

fn intact() -> RawSample {
    raw(100_000.0, 298.15)
}

/// A measuring node without faults.
fn measuring() -> Bench {
    let mut bench = Bench::booted_as(Personality::Combined);
    bench.encoder.board = Board { supply: Some(5000), current: Some(100), ..Board::default() };
    (0..20).for_each(|_| bench.sample(&intact()));
    bench.nmt(1);
    bench.take();
    bench
}

/// Causes the fault from outside, if the bench can; otherwise reports it like the firmware.
fn provoke(bench: &mut Bench, fault: Any) {
    match fault {
        Any::Node(fault) => provoke_in_node(bench, fault),
        Any::Bus(fault) => provoke_on_bus(bench, fault),
    }
}

fn provoke_in_node(bench: &mut Bench, fault: Fault) {
    let mut sample = intact();
    match fault.name {
        "SensorBreak" => sample.pressure = 100,
        "PressureRail" => sample.pressure = 0,
        "TemperatureRail" => sample.temperature = 0,
        "EncoderBreak" => bench.write(0x2100, 1, &[2]).unwrap(),
        // More counts in a millisecond than any encoder can make.
        "EncoderPosition" => bench.encoder.counter = 20_000,
        "InputCurrent" => bench.encoder.board.current = Some(1000),
        "InputVoltage" => bench.encoder.board.supply = Some(0),
        "HardwareMemory" => bench.encoder.board.memory_error = true,
        _ => return bench.set_fault(fault, true),
    }
    (0..1000).for_each(|_| bench.sample(&sample));
}

fn provoke_on_bus(bench: &mut Bench, fault: canopen::Fault) {
    use canopen::Fault;
    match fault {
        Fault::Overrun => return bench.bus_event(BusEvent::Overrun),
        Fault::ErrorPassive => return bench.bus_event(BusEvent::Passive),
        Fault::BusOffRecovered => {
            bench.bus_event(BusEvent::BusOff);
            return bench.bus_event(BusEvent::Recovered);
        }
        Fault::SyncLength => return bench.receive(&Frame::new(0x80, &[1, 2]).unwrap()),
        Fault::SyncMissing => {
            bench.write(0x1006, 0, &5000_u32.to_le_bytes()).unwrap();
            bench.receive(&Frame::new(0x80, &[]).unwrap());
        }
        Fault::RpdoTooShort(_) => return receive_pdo(bench, 1, &[]),
        Fault::RpdoTooLong(_) => return receive_pdo(bench, 1, &[1, 2]),
        Fault::RpdoDeadline(_) => {
            bench.write(0x1400, 5, &10_u16.to_le_bytes()).unwrap();
            receive_pdo(bench, 1, &[1]);
        }
        Fault::MpdoNotTaken => {
            return receive_pdo(bench, MULTIPLEXED, &[0x80 | ID, 0x00, 0x50, 0, 0, 0, 0, 0]);
        }
        Fault::Heartbeat(_) => {
            bench.write(0x1016, 1, &0x0005_0005_u32.to_le_bytes()).unwrap();
            bench.receive(&Frame::new(0x705, &[5]).unwrap());
        }
        Fault::StoredData(group) => return lose_stored(bench, group),
        Fault::OlderData(group) => {
            store(bench, group, 5);
            return lose_stored(bench, group);
        }
        _ => unreachable!("the node names its own, and has no life guarding"),
    }
    (0..1000).for_each(|_| bench.sample(&intact()));
}

/// Stores a group with a new value.
fn store(bench: &mut Bench, group: Group, value: u8) {
    let (index, sub) = match group {
        Group::Communication => {
            bench.write(0x1017, 0, &[value, 0]).unwrap();
            (0x1010, 2)
        }
        Group::Application => {
            bench.write(0x4000, 1, &[value, 0, 0, 0]).unwrap();
            (0x1010, 3)
        }
        _ => {
            bench.write(0x2203, 0, b"cali").unwrap();
            bench.write(0x2202, 1, &[value, 0, 0, 0]).unwrap();
            (0x2204, 0)
        }
    };
    bench.write(index, sub, b"save").unwrap();
}

/// Stores a group, and starts with one bit of the record changed. The very first save writes records of all groups, so
/// another group is saved before.
fn lose_stored(bench: &mut Bench, group: Group) {
    store(bench, if group == Group::Application { Group::Communication } else { Group::Application }, 3);
    store(bench, group, 7);
    *bench = std::mem::replace(bench, Bench::booted()).power_cycled_with_damage();
    bench.restart();
    (0..20).for_each(|_| bench.sample(&intact()));
}

/// Sends RPDO 1 with `objects` mapped objects, the first of which is a dummy byte (CiA 301, 7.4.7.1), and this data.
fn receive_pdo(bench: &mut Bench, objects: u8, data: &[u8]) {
    let id = 0x200 + u16::from(ID);
    bench.write(0x1600, 1, &0x0005_0008_u32.to_le_bytes()).unwrap();
    bench.write(0x1600, 0, &[objects]).unwrap();
    bench.write(0x1400, 1, &u32::from(id).to_le_bytes()).unwrap();
    bench.receive(&Frame::new(id, data).unwrap());
}

/// EMCY messages sent since the last call.
fn emergencies(bench: &mut Bench) -> Vec<[u8; 8]> {
    let messages = bench.take().into_iter().filter(|(id, _)| *id == EMCY);
    messages.map(|(_, data)| data.try_into().unwrap()).collect()
}

#[test]
fn the_table_has_every_fault_that_the_node_can_signal() {
    let of_a_kind = |fault: Any| fault.name().split('(').next().unwrap().to_string();
    let known: BTreeSet<_> = rows().filter_map(|row| row.fault).map(of_a_kind).collect();
    assert_eq!(known, Any::all().map(of_a_kind).collect());
    for row in rows() {
        assert_eq!(row.fault.map_or(row.code, Any::code), row.code, "{row:X?}");
    }
}

#[test]
fn every_code_that_is_never_sent_has_a_reason() {
    let sent: BTreeSet<u16> = Any::all().map(Any::code).collect();
    for row in rows().filter(|row| row.fault.is_none()) {
        assert!(!sent.contains(&row.code) && !row.remark.is_empty(), "{row:X?}");
    }
}

#[test]
fn every_fault_is_reported_by_emcy_list_register_and_flag() {
    for row in rows() {
        let Some(fault) = row.fault else { continue };
        let mut bench = measuring();
        assert_eq!(bench.read(0x1001, 0), Ok(vec![0]), "{row:X?}");
        provoke(&mut bench, fault);
        let messages = emergencies(&mut bench);
        let [low, high] = row.code.to_le_bytes();
        let Some([a, b, register, detail @ ..]) = messages.iter().find(|data| data[..2] == [low, high])
        else {
            panic!("{row:X?}: {messages:X?}");
        };
        assert_eq!(([*a, *b], detail), ([low, high], &fault.condition().detail), "{row:X?}");
        assert_eq!(register & 1, 1, "{row:X?}");
        let is_alone = messages.iter().all(|data| data[..2] == [low, high] || data[..2] == [0, 0]);
        assert!(is_alone || row.code >> 8 != 0x63, "only the group that is damaged is told: {messages:X?}");
        let listed: Vec<_> = (1..=10).filter_map(|sub| bench.read(0x1003, sub).ok()).collect();
        assert!(listed.contains(&vec![low, high, 0, 0]), "{row:X?}: {listed:X?}");
        let is_over = messages.last().is_some_and(|data| data[..2] == [0, 0]);
        assert_eq!(bench.read(0x1001, 0).unwrap()[0] == 0, is_over, "{row:X?}");
        if let Some((index, sub, bit)) = row.flag {
            let flags = u32::from_le_bytes(bench.read(index, sub).unwrap().try_into().unwrap());
            assert_ne!(flags & 1 << bit, 0, "{row:X?}: {flags:X}");
            assert!(flags == 1 << bit || row.code >> 8 != 0x63, "{row:X?}: {flags:X}");
            let other = u32::from_le_bytes(bench.read(index, 4 - sub).unwrap().try_into().unwrap());
            assert!(other == 0 || row.code >> 8 != 0x63, "{row:X?}: {other:X}");
            let summary = bench.read(0x1002, 0).unwrap()[0];
            assert_eq!(summary, u8::from(sub == 1) | 1 << 2, "{row:X?}: 1002h");
        }
    }
}

#[test]
fn a_fault_withdrawn_by_the_firmware_is_cleared_everywhere() {
    for row in rows() {
        let (Some(Any::Node(fault)), Some((index, sub, bit))) = (row.fault, row.flag) else { continue };
        let mut bench = measuring();
        for is_set in [true, false] {
            bench.set_fault(fault, is_set);
            let flags = u32::from_le_bytes(bench.read(index, sub).unwrap().try_into().unwrap());
            assert_eq!(flags, u32::from(is_set) << bit, "{row:X?}");
        }
        assert_eq!(emergencies(&mut bench).last(), Some(&[0; 8]), "{row:X?}");
        assert_eq!(bench.read(0x1001, 0), Ok(vec![0]), "{row:X?}");
    }
}
