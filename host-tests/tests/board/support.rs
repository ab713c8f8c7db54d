//! A world of emulated boards, as in `cargo sim`, and a client in this world.

use std::path::{Path, PathBuf};

use canbus::{Frame, StandardId, Time};
use clap::Parser;
use host_tests::boards::watch;
use sim::cli::Options;
use sim::port::Adapter;
use sim::summary::Summary;
use sim::world::{PortId, World};

pub(crate) const SECOND: Time = Time::from_millis(1000);
/// TPDO1, SDO server and client, NMT, SYNC (CiA 301, 7.3.3).
pub(crate) const TPDO1: u16 = 0x181;
pub(crate) const SDO_REQUEST: u16 = 0x601;
pub(crate) const SDO_RESPONSE: u16 = 0x581;
pub(crate) const SYNC: u16 = 0x080;
/// LSS (CiA 305).
pub(crate) const LSS_REQUEST: u16 = 0x7E5;
pub(crate) const LSS_RESPONSE: u16 = 0x7E4;
pub(crate) const START_ALL: (u16, [u8; 2]) = (0x000, [1, 0]);

/// The directory of the ELF files: $NODE_IMAGES, or the default output of cargo.
pub(crate) fn images() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).with_file_name("target"), PathBuf::from);
    let built = || target.join("thumbv7em-none-eabihf/release");
    let dir = std::env::var_os("NODE_IMAGES").map_or_else(built, PathBuf::from);
    for name in ["bootloader", "firmware"] {
        assert!(
            dir.join(name).exists(),
            "no {name} in {}; run `cargo xtask images --development` to build it",
            dir.display()
        );
    }
    dir
}

/// The ELF file of the application.
pub(crate) fn firmware() -> Vec<u8> {
    std::fs::read(images().join("firmware")).unwrap()
}

/// A world like that of `cargo sim` with these flags, but without sockets.
pub(crate) fn world(flags: &str) -> World {
    world_of("bootloader", flags)
}

/// Like [`world`], with another bootloader than that of a development board; the application is in the same directory.
pub(crate) fn world_of(bootloader: &str, flags: &str) -> World {
    let mut world = unwatched(bootloader, flags);
    watch(&mut world);
    world
}

/// Like [`world_of`], without the monitor: for a test that breaks the node itself.
pub(crate) fn unwatched(bootloader: &str, flags: &str) -> World {
    let bootloader = images().join(bootloader);
    let firmware = bootloader.with_file_name("firmware");
    let images =
        ["sim", "--bootloader", bootloader.to_str().unwrap(), "--firmware", firmware.to_str().unwrap()];
    let cycles = if flags.contains("--cycles") { String::new() } else { format!("--cycles {}", estimate()) };
    let flags = flags.split_whitespace().chain(cycles.split_whitespace());
    let options = Options::try_parse_from(images.into_iter().chain(flags)).unwrap();
    let mut world = sim::setup::world(&options).unwrap();
    world.enforce_rules(true);
    world
}

/// The cycle estimate of tests that do not choose one. With `CYCLES=worst` in the environment all these tests must pass
/// as well.
fn estimate() -> String {
    std::env::var("CYCLES").unwrap_or_else(|_| "modelled".into())
}

/// A node that has run for a second; its log is already taken.
pub(crate) fn running() -> World {
    let mut world = world("--bitrate 1000");
    world.run_until(SECOND);
    world.take_log();
    world
}

/// The log of the node in the next second, in which the node must boot once more and measure again.
pub(crate) fn comes_back(world: &mut World) -> String {
    let before = world.summary(1.0, 0);
    let after = run(world, SECOND);
    let (before, after) = (&before.nodes[0], &after.nodes[0]);
    let log: Vec<String> = world.take_log().into_iter().map(|line| line.text).collect();
    let log = log.join("\n");
    assert_eq!(after.heard.boot_ups, before.heard.boot_ups + 1, "it boots once more: {log}");
    assert!(after.sampling.samples > before.sampling.samples + 500, "it measures again: {log}");
    assert!(after.heard.process_value.is_some(), "it sends again: {log}");
    log
}

pub(crate) fn frame(id: u16, bytes: &[u8]) -> Frame {
    Frame::data(StandardId::new(id).unwrap(), bytes).unwrap()
}

/// An SDO request for an object.
fn request(command: u8, (index, sub): (u16, u8), value: u32) -> [u8; 8] {
    let ([low, high], [a, b, c, d]) = (index.to_le_bytes(), value.to_le_bytes());
    [command, low, high, sub, a, b, c, d]
}

/// A client on the bus, at 1 Mbit/s by default.
pub(crate) struct Master {
    pub(crate) port: PortId,
}

impl Master {
    pub(crate) fn join(world: &mut World) -> Master {
        Master::join_at(world, 1_000_000)
    }

    /// A client at a bit rate in bit/s.
    pub(crate) fn join_at(world: &mut World, bit_rate: u32) -> Master {
        let port = world.open_port();
        world.port(port).attach(Some(Adapter { bit_rate, silent: false }));
        Master { port }
    }

    /// One SDO exchange with a node.
    pub(crate) fn ask(&self, world: &mut World, node: u8, request: &[u8; 8]) -> Vec<u8> {
        let response = 0x580 + u16::from(node);
        self.heard(world, response);
        self.send(world, 0x600 + u16::from(node), request);
        for _ in 0..200 {
            world.run_until(world.now() + Time::from_millis(1));
            if let Some(frame) = self.heard(world, response).first() {
                return frame.bytes().to_vec();
            }
        }
        panic!("no response to {request:x?}");
    }

    /// An LSS request; returns the answers in the next milliseconds.
    pub(crate) fn lss(&self, world: &mut World, request: &[u8; 8]) -> Vec<Vec<u8>> {
        self.heard(world, LSS_RESPONSE);
        self.send(world, LSS_REQUEST, request);
        world.run_until(world.now() + Time::from_millis(50));
        self.heard(world, LSS_RESPONSE).iter().map(|frame| frame.bytes().to_vec()).collect()
    }

    pub(crate) fn send(&self, world: &mut World, id: u16, bytes: &[u8]) {
        let now = world.now();
        world.port(self.port).send(frame(id, bytes), now);
    }

    /// The frames with this identifier since the last call; other frames are dropped.
    pub(crate) fn heard(&self, world: &mut World, id: u16) -> Vec<Frame> {
        let port = world.port(self.port);
        let all = std::iter::from_fn(|| port.receive()).map(|stamped| stamped.frame);
        all.filter(|frame| frame.id() == StandardId::new(id).unwrap().into()).collect()
    }
}

/// Reads an object of node 1, of at most four bytes, as a number.
pub(crate) fn read(world: &mut World, master: &Master, object: (u16, u8)) -> u32 {
    let answer = master.ask(world, 1, &request(0x40, object, 0));
    assert_eq!(answer[0] & 0xE3, 0x43, "{object:x?}: {answer:x?}");
    let unused = usize::from(answer[0] >> 2 & 3);
    answer[4..8 - unused].iter().rev().fold(0, |value, &byte| value << 8 | u32::from(byte))
}

/// Writes an object of node 1 of `size` bytes.
pub(crate) fn write(world: &mut World, master: &Master, object: (u16, u8), size: u8, value: u32) {
    let answer = master.ask(world, 1, &request(0x23 | (4 - size) << 2, object, value));
    assert_eq!(answer[0], 0x60, "{object:x?}: {answer:x?}");
}

/// Runs for `span` and returns the summary since power-on.
pub(crate) fn run(world: &mut World, span: Time) -> Summary {
    let started = std::time::Instant::now();
    world.run_until(world.now() + span);
    world.summary(started.elapsed().as_secs_f64(), 0)
}
