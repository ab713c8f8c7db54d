//! Damage to stored values: one bit changes while the power is off. After its boot-up message the node reports the
//! damaged group and the values used instead. It reports no other group.

use canbus::{Id, Time};
use host_tests::watch::expects;
use monitor::Rule;
use sim::world::World;

use crate::support::{Master, SECOND, world};

/// The parameter pages (memory.x).
const PAGES: u32 = 0x0800_8000;
const SIZE: usize = 0x8000;
/// EMCY, error control and TPDO 1 (CiA 301, 7.3.5).
const EMCY: u16 = 0x080;
const BOOT_UP: u16 = 0x700;
const TPDO1: u16 = 0x180;
/// The heartbeat of another node.
const SOMEBODY: u16 = 0x77F;
/// First byte of the error field: the values used instead of the last stored ones.
const OLDER: u8 = 1;
const DEFAULTS: u8 = 2;
/// Values whose bytes occur nowhere else in the pages.
const OLD: u32 = 0x5A17;
const NEW: u32 = 0x6B29;
const OTHER: u32 = 0x1235;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Group {
    Device,
    Communication,
    Application,
    Calibration,
}

const ALL: [Group; 4] = [Group::Device, Group::Communication, Group::Application, Group::Calibration];

/// The checks of a node.
struct Examiner {
    world: World,
    master: Master,
    node: u8,
}

impl Group {
    fn code(self) -> u16 {
        match self {
            Group::Device => 0x6301,
            Group::Communication => 0x6302,
            Group::Application => 0x6303,
            Group::Calibration => 0x6300,
        }
    }

    /// Flags of 3000h:1 and 3000h:3.
    fn flags(self) -> [u32; 2] {
        match self {
            Group::Device => [0, 1 << 3],
            Group::Communication => [0, 1 << 4],
            Group::Application => [0, 1 << 5],
            Group::Calibration => [1, 0],
        }
    }

    /// The object whose value tells one set from another, the object's default, and the save command of the group.
    fn objects(self) -> ((u16, u8), u32, (u16, u8)) {
        match self {
            Group::Device => unreachable!("LSS stores the device record"),
            Group::Communication => ((0x1017, 0), 1000, (0x1010, 2)),
            Group::Application => ((0x4000, 1), 0, (0x1010, 3)),
            Group::Calibration => ((0x2202, 1), 0, (0x2204, 0)),
        }
    }

    /// The value as stored in its record: in the device record the node-ID is followed by the personality and the bit
    /// rate.
    fn bytes(self, value: u32) -> Vec<u8> {
        let [a, b, c, d] = value.to_le_bytes();
        match self {
            Group::Device => vec![node_id(value), 0, 250, 0],
            Group::Communication => vec![a, b],
            Group::Application | Group::Calibration => vec![a, b, c, d],
        }
    }
}

/// The node-ID that stands for a value of the device record.
fn node_id(value: u32) -> u8 {
    if value == NEW { 2 } else { 1 }
}

impl Examiner {
    /// A node that becomes Operational without a command once its communication parameters are saved.
    fn new() -> Examiner {
        let mut world = world("--pressure const:250000");
        let master = Master::join_at(&mut world, 250_000);
        world.run_until(SECOND);
        let mut examiner = Examiner { world, master, node: 1 };
        examiner.write((0x1F80, 0), 4, 8);
        examiner
    }

    fn read(&mut self, (index, sub): (u16, u8)) -> u32 {
        let [low, high] = index.to_le_bytes();
        let answer = self.master.ask(&mut self.world, self.node, &[0x40, low, high, sub, 0, 0, 0, 0]);
        assert_eq!(answer[0] & 0xE3, 0x43, "{index:x}h:{sub}: {answer:x?}");
        let len = 8 - usize::from(answer[0] >> 2 & 3);
        answer[4..len].iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
    }

    fn write(&mut self, (index, sub): (u16, u8), size: u8, value: u32) {
        let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
        let request = [0x23 | (4 - size) << 2, low, high, sub, a, b, c, d];
        let answer = self.master.ask(&mut self.world, self.node, &request);
        assert_eq!(answer[0], 0x60, "{index:x}h:{sub}: {answer:x?}");
    }

    fn save(&mut self, group: Group, value: u32) {
        if group == Group::Device {
            self.master.lss(&mut self.world, &[0x04, 1, 0, 0, 0, 0, 0, 0]);
            for request in [[0x11, node_id(value)], [0x17, 0]] {
                let [command, argument] = request;
                let answers = self.master.lss(&mut self.world, &[command, argument, 0, 0, 0, 0, 0, 0]);
                assert_eq!(answers[0][..2], [command, 0]);
            }
            self.master.lss(&mut self.world, &[0x04, 0, 0, 0, 0, 0, 0, 0]);
            return;
        }
        let (object, _, save) = group.objects();
        if group == Group::Calibration {
            self.write((0x2203, 0), 4, u32::from_le_bytes(*b"cali"));
        }
        self.write(object, if group == Group::Communication { 2 } else { 4 }, value);
        self.write(save, 4, u32::from_le_bytes(*b"save"));
    }

    /// Changes a bit of the last record with this value.
    fn damage(&mut self, group: Group, value: u32) {
        let mut pages = vec![0; SIZE];
        self.world.machine(0).read(PAGES, &mut pages).unwrap();
        let bytes = group.bytes(value);
        let at = (0..SIZE).rev().find(|&at| pages[at..].starts_with(&bytes)).expect("it is stored");
        let address = PAGES + u32::try_from(at).unwrap();
        self.world.machine(0).write(address, &[pages[at] ^ 0x80]).unwrap();
    }

    /// Switches the power off and on. Returns the EMCY messages as code and first byte of the error field, and whether
    /// the node has become Operational without a command. No message may come before the boot-up message.
    fn power_cycle(&mut self, node: u8) -> (Vec<(u16, u8)>, bool) {
        self.node = node;
        let now = self.world.now();
        self.world.machine(0).power_off();
        self.world.machine(0).power_on(now);
        self.world.take_frames();
        // A node without a record listens until another node sends a frame.
        for round in 1..=50 {
            self.world.run_until(now + Time::from_millis(20 * round));
            self.master.send(&mut self.world, SOMEBODY, &[5]);
        }
        self.world.run_until(now + SECOND * 2);
        let frames = self.world.take_frames();
        let frames = frames.iter().map(|sent| said(&sent.frame)).filter(|(id, _)| *id != SOMEBODY);
        let frames: Vec<_> = frames.collect();
        assert_eq!(frames.first(), Some(&(BOOT_UP + u16::from(node), vec![0])), "{frames:x?}");
        let emergencies = frames.iter().filter(|(id, _)| *id == EMCY + u16::from(node));
        let told = emergencies.map(|(_, data)| (u16::from_le_bytes([data[0], data[1]]), data[3])).collect();
        (told, frames.iter().any(|(id, _)| *id == TPDO1 + u16::from(node)))
    }
}

fn said(frame: &canbus::Frame) -> (u16, Vec<u8>) {
    let Id::Standard(id) = frame.id() else { panic!("an identifier of 29 bits") };
    (id.as_raw(), frame.bytes().to_vec())
}

/// The damaged record: the newest of two saves, the one before the newest, or the only one.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Newest,
    Superseded,
    Only,
}

/// Every group and every kind of damage.
#[test]
fn only_the_damaged_group_is_reported_with_its_code_and_its_replacement() {
    let _expected = expects([Rule::SaveLost]);
    for group in ALL {
        for kind in [Kind::Newest, Kind::Superseded, Kind::Only] {
            let mut examiner = Examiner::new();
            let others = ALL.into_iter().filter(|other| !matches!(other, Group::Device) && *other != group);
            others.for_each(|other| examiner.save(other, OTHER));
            // The device record has already been stored in production.
            let is_stored = group == Group::Device;
            if kind != Kind::Only && !is_stored {
                examiner.save(group, OLD);
            }
            if kind != Kind::Only || !is_stored {
                examiner.save(group, NEW);
            }
            let is_newest = kind == Kind::Newest || kind == Kind::Only && !is_stored;
            examiner.damage(group, if is_newest { NEW } else { OLD });

            let holds = if kind == Kind::Superseded { NEW } else { OLD };
            let node = if is_stored { node_id(holds) } else { 1 };
            let expected = match kind {
                Kind::Newest => vec![(group.code(), OLDER)],
                Kind::Superseded => vec![],
                Kind::Only => vec![(group.code(), DEFAULTS)],
            };
            let context = format!("{group:?}, {kind:?}");
            let is_told = !expected.is_empty();
            assert_eq!(examiner.power_cycle(node), (expected, !is_told), "{context}");
            for other in ALL.into_iter().filter(|other| *other != Group::Device) {
                let (object, default, _) = other.objects();
                let value = match kind {
                    _ if other != group => OTHER,
                    Kind::Only => default,
                    _ => holds,
                };
                assert_eq!(examiner.read(object), value, "{context}: {other:?}");
            }
            let [sensor, system] = if is_told { group.flags() } else { [0, 0] };
            assert_eq!(
                [examiner.read((0x3000, 1)), examiner.read((0x3000, 3))],
                [sensor, system],
                "{context}"
            );
            assert_eq!(examiner.read((0x1001, 0)), u32::from(is_told), "{context}");
            let summary = u32::from(sensor != 0) | u32::from(is_told) << 2;
            assert_eq!(examiner.read((0x1002, 0)), summary, "{context}");
        }
    }
}

/// `cargo sim --flash`: the kept flash of a board with a damaged device record is not changed, and the node reports the damage.
#[test]
fn the_simulator_keeps_the_parameters_of_a_board_with_a_damaged_device_record() {
    let dir = std::env::temp_dir().join(format!("sim-damaged-{}", std::process::id()));
    let flags = format!("--pressure const:250000 --flash {}", dir.display());
    let mut examiner = Examiner::new();
    examiner.save(Group::Application, NEW);
    let mut flash = examiner.world.boards()[0].flash();
    // The node-ID in the first record of the first page (crates/storage): the device record of a new board.
    flash[0x8018] ^= 0x40;
    sim::flash::save(&dir, 1, &flash).unwrap();
    let mut world = world(&flags);
    assert_eq!(world.boards()[0].flash()[0x8000..0x1_0000], flash[0x8000..0x1_0000], "before the start");
    let master = Master::join_at(&mut world, 250_000);
    for round in 1..=50 {
        world.run_until(Time::from_millis(20 * round));
        master.send(&mut world, SOMEBODY, &[5]);
    }
    world.run_until(SECOND * 2);
    let frames: Vec<_> = world.take_frames().iter().map(|sent| said(&sent.frame)).collect();
    let emcy = frames.iter().find(|(id, _)| *id == EMCY + 1).expect("an EMCY");
    assert_eq!((emcy.1[0], emcy.1[1], emcy.1[3]), (0x01, 0x63, DEFAULTS));
    let mut examiner = Examiner { world, master, node: 1 };
    assert_eq!(examiner.read((0x4000, 1)), NEW, "the other groups are there");
    std::fs::remove_dir_all(dir).unwrap();
}

/// The EMCY of a lasting fault follows the boot-up message, at power-on and at a reset of the communication.
#[test]
fn nothing_comes_before_the_boot_up_message() {
    for rate in [10, 125, 1000] {
        let mut world = world(&format!("--bitrate {rate} --fault open-sensor@0"));
        let master = Master::join_at(&mut world, rate * 1000);
        world.run_until(SECOND * 2);
        let first: Vec<_> = world.take_frames().iter().map(|sent| said(&sent.frame)).collect();
        assert_order(&first, rate);
        master.send(&mut world, 0, &[0x82, 1]);
        world.run_until(world.now() + Time::from_millis(900));
        let sent: Vec<_> = world.take_frames().iter().map(|sent| said(&sent.frame)).collect();
        assert_eq!(sent.first(), Some(&(0, vec![0x82, 1])));
        assert_order(&sent[1..], rate);
    }
}

fn assert_order(frames: &[(u16, Vec<u8>)], rate: u32) {
    assert_eq!(frames.first(), Some(&(BOOT_UP + 1, vec![0])), "{rate} kbit/s: {frames:x?}");
    let codes: Vec<u16> = frames
        .iter()
        .filter(|(id, _)| *id == EMCY + 1)
        .map(|(_, data)| u16::from_le_bytes([data[0], data[1]]))
        .collect();
    assert!(codes.contains(&0x5006) && codes.contains(&0x8002), "{rate} kbit/s: {codes:x?}");
}
