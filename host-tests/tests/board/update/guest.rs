//! Two boards and a master on one bus. One board is damaged while its power is off: its neighbour is not disturbed, and
//! an update repairs the damaged board.

use bsp::flash::update_layout::LAYOUT;
use canbus::Time;
use host_tests::sdo::Failure;
use host_tests::thorough::either;
use storage::{DeviceRecord, Memory, Pages};

use super::bench::{BOOT, Bench, CONTROL, DEVICE_TYPE, HEADER, version_a};
use crate::support::SECOND;

const PARAMETERS: u32 = 0x0800_8000;
const PARAMETERS_LEN: usize = 0x8000;
const FLASH: u32 = 0x0800_0000;
/// Node-IDs of the damaged board and of its neighbour.
const DAMAGED: u8 = 1;
const NEIGHBOUR: u8 = 2;
/// Node-ID of a board without a device record.
const NOBODY: u8 = 126;

/// The time for which the neighbour is observed.
fn span() -> Time {
    either(SECOND * 2, SECOND * 60)
}

/// The damaged part.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Damage {
    Application,
    Header,
    /// One bit of the device record.
    Record,
    /// Both pages of the store.
    Parameters,
    Staging,
    /// A pending image to copy that is not valid.
    Pending,
    /// Application and device record.
    Both,
}

impl Damage {
    const ALL: [Damage; 7] = [
        Damage::Application,
        Damage::Header,
        Damage::Record,
        Damage::Parameters,
        Damage::Staging,
        Damage::Pending,
        Damage::Both,
    ];

    fn apply(self, bench: &mut Bench) {
        let staging = FLASH + LAYOUT.staging().start();
        match self {
            Damage::Application => flip(bench, HEADER + 0x5000),
            Damage::Header => flip(bench, HEADER + 20),
            Damage::Record => {
                let at = record(bench);
                flip(bench, at);
            }
            Damage::Parameters => bench.machine().write(PARAMETERS, &[0xA5; PARAMETERS_LEN]).unwrap(),
            Damage::Staging => bench.machine().write(staging, &[0x5A; 4096]).unwrap(),
            Damage::Pending => {
                bench.machine().write(staging, &version_a().to_bytes()[..4096]).unwrap();
                let end = FLASH + LAYOUT.staging().end();
                let record = [*b"COPYTHIS", *b"\0\0\0\0\xFF\xFF\xFF\xFF"].concat();
                bench.machine().write(end - 16, &record).unwrap();
            }
            Damage::Both => {
                Damage::Application.apply(bench);
                Damage::Parameters.apply(bench);
            }
        }
    }

    /// Whether the application starts in spite of the damage.
    fn is_harmless(self) -> bool {
        matches!(self, Damage::Staging | Damage::Pending)
    }

    /// Whether the application starts, but with another node-ID and bit rate.
    fn is_lost(self) -> bool {
        matches!(self, Damage::Record | Damage::Parameters)
    }
}

fn flip(bench: &mut Bench, address: u32) {
    let mut byte = [0];
    bench.machine().read(address, &mut byte).unwrap();
    bench.machine().write(address, &[byte[0] ^ 0x10]).unwrap();
}

/// The address of the node-ID in the device record that the factory has stored.
fn record(bench: &mut Bench) -> u32 {
    let mut pages = vec![0; PARAMETERS_LEN];
    bench.machine().read(PARAMETERS, &mut pages).unwrap();
    let kbit = u16::try_from(bench.bit_rate() / 1000).unwrap().to_le_bytes();
    let bytes = [DAMAGED, 0, kbit[0], kbit[1]];
    let at = pages.windows(4).position(|window| window == bytes).expect("the factory has stored it");
    PARAMETERS + u32::try_from(at).unwrap()
}

/// A bus with a board that was damaged while its power was off and has started again.
fn damaged(kbit: u32, damage: Damage) -> Bench {
    let nodes = "--node 1:pressure --node 2:pressure";
    let mut bench = Bench::new(&format!("--bitrate {kbit} {nodes}"), kbit * 1000, DAMAGED);
    bench.run(SECOND);
    bench.machine().power_off();
    damage.apply(&mut bench);
    let now = bench.world.now();
    bench.machine().power_on(now);
    bench
}

fn errors(bench: &Bench) -> u64 {
    bench.world.summary(1.0, 0).bus.errors
}

/// Whether the bootloader answers. A listening board must first hear a frame.
fn is_found(bench: &mut Bench) -> bool {
    (0..20).any(|_| bench.read(DEVICE_TYPE) == Ok(BOOT.to_vec()))
}

/// The neighbour continues to send frames, and no bus error occurs.
#[test]
fn a_damaged_board_does_not_disturb_its_neighbour_and_an_update_repairs_it() {
    for (index, kbit) in [500, 1000].into_iter().enumerate() {
        let damages = Damage::ALL.into_iter().filter(|damage| !damage.is_lost());
        // All kinds at both bit rates in a thorough run, otherwise every other kind at each.
        for damage in damages.skip(either(index, 0)).step_by(either(2, 1)) {
            let mut bench = damaged(kbit, damage);
            let before = errors(&bench);
            bench.run(span());
            assert_eq!(errors(&bench) - before, 0, "{kbit} kbit/s, {damage:?}");
            bench.node = NEIGHBOUR;
            assert_eq!(bench.read(CONTROL), Ok(vec![1]), "the neighbour runs");

            bench.node = if damage == Damage::Both { NOBODY } else { DAMAGED };
            if damage.is_harmless() {
                assert_eq!(bench.identification_of_running(), version_a().header.code_crc(), "{damage:?}");
                continue;
            }
            assert!(is_found(&mut bench), "{kbit} kbit/s, {damage:?}");
            bench.clear();
            bench.download(&version_a().to_bytes()).unwrap();
            bench.wait_for_flash();
            assert_eq!(errors(&bench) - before, 0, "{kbit} kbit/s, {damage:?}");
            println!(
                "{kbit} kbit/s, {damage:?}: no bus error in {} s and in the update",
                span().as_secs_f64()
            );
        }
    }
}

/// The bootloader joins the bus, refuses the image that waits to be copied, and resets: its boot-up message is complete.
#[test]
fn a_staged_image_that_is_refused_costs_no_frame() {
    for kbit in [10, 20, 50, 125, 250, 500, 1000] {
        let mut bench = damaged(kbit, Damage::Pending);
        let (errors_before, boot_ups_before) = (errors(&bench), boot_ups(&bench));
        bench.run(SECOND * 3);
        assert_eq!(errors(&bench) - errors_before, 0, "{kbit} kbit/s");
        assert_eq!(
            boot_ups(&bench) - boot_ups_before,
            2,
            "{kbit} kbit/s: of the bootloader and of the application"
        );
        assert_eq!(bench.identification_of_running(), version_a().header.code_crc(), "{kbit} kbit/s");
    }
}

fn boot_ups(bench: &Bench) -> u64 {
    bench.world.traffic().node(DAMAGED).boot_ups
}

/// A record with 250 kbit/s on a bus at 1 Mbit/s: one or two frames are destroyed, and the node then joins the bus at
/// its bit rate.
#[test]
fn a_record_that_does_not_fit_the_bus_costs_two_frames_at_most() {
    let mut bench = Bench::new("--bitrate 1000 --node 1:pressure --node 2:pressure", 1_000_000, DAMAGED);
    bench.run(SECOND);
    bench.machine().power_off();
    Damage::Header.apply(&mut bench);
    let mut pages = [0xFF; PARAMETERS_LEN];
    let stored = DeviceRecord::new(DAMAGED, 250, 0).unwrap();
    storage::provision(Memory(&mut pages[..]), Pages::new(0, 0x4000), &stored).unwrap();
    bench.machine().write(PARAMETERS, &pages).unwrap();
    let now = bench.world.now();
    bench.machine().power_on(now);
    let before = errors(&bench);
    bench.run(span());
    let destroyed = errors(&bench) - before;
    println!("a record that does not fit: {destroyed} frames destroyed in {} s", span().as_secs_f64());
    assert!(destroyed <= 2, "{destroyed}");
    assert!(is_found(&mut bench));
}

/// The application of a board without a device record also detects the bit rate of the bus.
#[test]
fn a_board_whose_record_is_damaged_comes_to_the_bus_where_the_bus_is() {
    for (index, kbit) in [500, 1000].into_iter().enumerate() {
        let damages = Damage::ALL.into_iter().filter(|damage| damage.is_lost());
        for damage in damages.skip(either(index, 0)).step_by(either(2, 1)) {
            let mut bench = damaged(kbit, damage);
            let before = errors(&bench);
            bench.run(span());
            assert_eq!(errors(&bench) - before, 0, "{kbit} kbit/s, {damage:?}");
            assert_eq!(bench.identification_of_running(), version_a().header.code_crc(), "{damage:?}");
            bench.update(&version_a());
        }
    }
}

/// A board without record and application on a silent bus: it sends nothing, and a master finds it as node 126 at 250
/// kbit/s.
#[test]
fn on_a_silent_bus_the_node_is_126_at_250_kbit_whenever_a_master_comes() {
    for seconds in [1, 10, 40] {
        let mut bench = Bench::new("--bitrate 250", 250_000, NOBODY);
        bench.run(SECOND);
        bench.machine().power_off();
        Damage::Both.apply(&mut bench);
        bench.attach(false);
        let (frames, before) = (bench.world.summary(1.0, 0).bus.frames, errors(&bench));
        let now = bench.world.now();
        bench.machine().power_on(now);
        bench.run(SECOND * seconds);
        assert_eq!(
            (bench.world.summary(1.0, 0).bus.frames, errors(&bench)),
            (frames, before),
            "it is silent"
        );
        bench.attach(true);
        assert_eq!(bench.read(DEVICE_TYPE), Err(Failure::Silence), "the first frame tells the bit rate");
        assert_eq!(bench.read(DEVICE_TYPE), Ok(BOOT.to_vec()), "after {seconds} s");
    }
}
