//! The bootloader as a CANopen device: its objects, and the writes that its program objects refuse.

use canbus::Time;
use canopen::sdo::Multiplexer;
use host_tests::sdo::{Client, Failure};

use super::bench::{BOOT, Bench, CLEAR, CONTROL, DATA, DEVICE_TYPE, START, signed, version_a};
use super::fleet::PERSONALITIES;
use crate::support::{Master, SECOND};

const NMT: u16 = 0x000;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;
const BOARD: Multiplexer = Multiplexer { index: 0x2004, sub: 1 };
const HEARTBEAT: Multiplexer = Multiplexer { index: 0x1017, sub: 0 };
/// SDO abort codes (CiA 301, table 22).
const INVALID_VALUE: Failure = Failure::Refused(0x0609_0030);
const COMMAND: Failure = Failure::Refused(0x0504_0001);
const DEVICE_STATE: Failure = Failure::Refused(0x0800_0022);

fn at(index: u16, sub: u8) -> Multiplexer {
    Multiplexer { index, sub }
}

fn in_bootloader() -> Bench {
    let mut bench = Bench::running();
    bench.stop();
    bench
}

#[test]
fn it_has_the_identity_of_the_application_in_every_personality() {
    for (personality, node) in PERSONALITIES.into_iter().zip([1, 16, 127, 2]) {
        let flags = format!("--bitrate 1000 --node {node}:{personality}");
        let mut bench = Bench::new(&flags, 1_000_000, node);
        bench.run(SECOND);
        let identity = |bench: &mut Bench| [1, 2, 3, 4].map(|sub| bench.word(at(0x1018, sub)));
        let before = (identity(&mut bench), bench.word(BOARD));
        bench.stop();
        let after = (identity(&mut bench), bench.word(BOARD));
        assert_eq!(after, before, "{personality}: the same node as before");
        assert_eq!(after.1, profiles::product::BOARD);
        assert_eq!(bench.read(at(0x1001, 0)).unwrap(), [0]);
        assert_eq!(bench.read(at(0x1008, 0)).unwrap(), b"Bootloader");
        assert_eq!(bench.read(at(0x1009, 0)).unwrap(), b"NUCLEO-F446RE");
        assert_eq!(bench.read(at(0x100A, 0)).unwrap(), env!("CARGO_PKG_VERSION").as_bytes());
    }
}

#[test]
fn it_sends_a_heartbeat_and_obeys_nmt() {
    let mut bench = in_bootloader();
    let heard =
        |bench: &Bench| (bench.world.traffic().node(1).boot_ups, bench.world.traffic().node(1).heartbeats);
    Client::new(&mut bench).write(HEARTBEAT, &100_u16.to_le_bytes()).unwrap();
    bench.run(Time::from_millis(50));
    let (boot_ups, heartbeats) = heard(&bench);
    bench.run(SECOND);
    assert_eq!(heard(&bench), (boot_ups, heartbeats + 10));

    bench.tell(NMT, &[RESET_COMMUNICATION, 1]);
    assert_eq!(heard(&bench).0, boot_ups + 1);
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    assert_eq!(bench.read(HEARTBEAT).unwrap(), 1000_u16.to_le_bytes(), "nothing is stored");

    bench.tell(NMT, &[RESET_NODE, 1]);
    assert_eq!(bench.identification_of_running(), version_a().header.code_crc());
}

#[test]
fn lss_changes_the_node_id_until_the_next_start() {
    let mut bench = in_bootloader();
    let master = Master::join(&mut bench.world);
    let lss = |bench: &mut Bench, request: [u8; 8]| master.lss(&mut bench.world, &request);
    lss(&mut bench, [4, 1, 0, 0, 0, 0, 0, 0]);
    assert_eq!(lss(&mut bench, [0x5E, 0, 0, 0, 0, 0, 0, 0]), [[0x5E, 1, 0, 0, 0, 0, 0, 0]]);
    assert_eq!(lss(&mut bench, [0x11, 5, 0, 0, 0, 0, 0, 0]), [[0x11, 0, 0, 0, 0, 0, 0, 0]]);
    assert_eq!(
        lss(&mut bench, [0x17, 0, 0, 0, 0, 0, 0, 0]),
        [[0x17, 2, 0, 0, 0, 0, 0, 0]],
        "nothing is stored"
    );
    lss(&mut bench, [4, 0, 0, 0, 0, 0, 0, 0]);
    bench.tell(NMT, &[RESET_COMMUNICATION, 1]);
    bench.node = 5;
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    bench.command(START).unwrap();
    bench.node = 1;
    assert_eq!(bench.identification_of_running(), version_a().header.code_crc());
}

#[test]
fn lss_changes_its_bit_rate() {
    const OF_500_KBIT: u8 = 2;
    let mut bench = in_bootloader();
    let master = Master::join(&mut bench.world);
    master.lss(&mut bench.world, &[4, 1, 0, 0, 0, 0, 0, 0]);
    let answer = master.lss(&mut bench.world, &[0x13, 0, OF_500_KBIT, 0, 0, 0, 0, 0]);
    assert_eq!(answer, [[0x13, 0, 0, 0, 0, 0, 0, 0]]);
    master.lss(&mut bench.world, &[0x15, 100, 0, 0, 0, 0, 0, 0]);
    bench.run(Time::from_millis(300));
    assert_eq!(bench.read(DEVICE_TYPE).unwrap(), BOOT);
    assert_eq!(bench.world.summary(1.0, 0).bus.bit_rate, 500);
}

#[test]
fn a_node_that_has_found_the_bit_rate_keeps_it() {
    let mut bench = Bench::new("--node 1:pressure@auto --bitrate 500", 500_000, 1);
    // Another node must acknowledge frames while the node only listens.
    let _other = Master::join_at(&mut bench.world, 500_000);
    let found = (0..100).any(|_| bench.is_running());
    assert!(found, "the node has found the bit rate");
    bench.stop();
}

#[test]
fn unknown_commands_and_commands_in_a_wrong_state_are_refused() {
    let mut bench = in_bootloader();
    for command in [4, 0x7F, 0x80, 0xFF] {
        assert_eq!(bench.command(command), Err(INVALID_VALUE), "{command:02X}h");
    }
    for nothing_to_do in [0, 2] {
        bench.command(nothing_to_do).unwrap();
    }
    bench.command(CLEAR).unwrap();
    for command in [START, CLEAR] {
        assert_eq!(bench.command(command), Err(DEVICE_STATE), "while the flash is busy");
    }
    bench.wait_for_flash();
    bench.machine().write(super::HEADER, &[0; 1024]).unwrap();
    assert_eq!(bench.command(START), Err(DEVICE_STATE), "there is no program");
}

#[test]
fn a_download_without_a_clear_is_refused_and_one_in_segments_is_taken() {
    let image = signed(vec![0xB0; 400], |_| ()).to_bytes();
    let mut bench = in_bootloader();
    assert_eq!(bench.download(&image), Err(DEVICE_STATE));
    assert_eq!(bench.status().code, 4);
    bench.clear();
    Client::new(&mut bench).write(DATA, &image).unwrap();
    assert_eq!(bench.wait_for_flash(), update::Status::GOOD);
    assert_eq!(bench.read(CONTROL).unwrap(), [0]);
}

/// The bootloader refuses a block upload with the abort code at which clients switch to segmented transfer.
#[test]
fn it_is_read_in_segments_and_not_in_blocks() {
    let mut bench = in_bootloader();
    let name = at(0x1008, 0);
    assert_eq!(Client::new(&mut bench).read_blocks(name, 127), Err(COMMAND));
    bench.run(Time::from_millis(10));
    assert_eq!(bench.read(name).unwrap(), b"Bootloader");
}
