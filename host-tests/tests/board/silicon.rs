//! Properties of the chips that a model of registers alone would not show: pins, errata, a late clock, memory that
//! decays. docs/evidence.md, Silicon, has the list.

use std::path::{Path, PathBuf};

use canbus::Time;
use chip::Loss;
use object::{Object, ObjectSection, ObjectSymbol};
use sim::world::World;

use crate::chip_faults::{BRANCH_TO_ITSELF, TIM2, peek, poke, run_broken};
use crate::encoder::{ALARMS, SENSOR_STATE, UNREFERENCED, cycle_power, start};
use crate::room::{ERASES, PRE_OPERATIONAL, save_change};
use crate::support::{Master, SECOND, images, read, run, running, world};

/// RCC_AHB1ENR, the clocks of the ports; port A, and the distance of two ports (RM0390, 6.3.10 and table 1).
const AHB1ENR: u32 = 0x4002_3830;
const PORT_A: u32 = 0x4002_0000;
const PORT: u32 = 0x400;
const OSPEEDR: u32 = 0x08;
const PUPDR: u32 = 0x0C;
/// 2001h:1.
const LOST_FRAMES: (u16, u8) = (0x2001, 1);
/// 2001h:9.
const CAN_RESETS: (u16, u8) = (0x2001, 9);

fn log(world: &mut World) -> String {
    let lines: Vec<String> = world.take_log().into_iter().map(|line| line.text).collect();
    lines.join("\n")
}

/// Bits of a pin in a register with two bits for each pin.
fn of_pin(value: u32, pin: u32) -> u32 {
    value >> (2 * pin) & 0b11
}

/// SSI clock at very high speed, CAN TX at medium speed, CAN RX pulled up.
#[test]
fn the_pins_of_can_and_ssi_have_their_speed_and_pull_up() {
    let mut world = running();
    let (speed, pull) = (peek(&mut world, PORT_A + PORT + OSPEEDR), peek(&mut world, PORT_A + PORT + PUPDR));
    assert_eq!((of_pin(speed, 13), of_pin(speed, 9), of_pin(pull, 8)), (3, 1, 1), "{speed:08X}h {pull:08X}h");
}

/// The only digital inputs without a peripheral are the buttons; their lines have pull-up resistors.
#[test]
fn no_unused_pin_is_a_floating_input() {
    let mut world = running();
    let clocks = peek(&mut world, AHB1ENR);
    poke(&mut world, AHB1ENR, clocks | 0xFF);
    let mut inputs = Vec::new();
    for (port, name) in (0..).zip('A'..='H') {
        let mode = peek(&mut world, PORT_A + port * PORT);
        inputs.extend((0..16).filter(|&pin| of_pin(mode, pin) == 0).map(|pin| format!("P{name}{pin}")));
    }
    assert_eq!(inputs, ["PC10", "PC13"]);
}

#[test]
fn the_images_have_no_code_that_an_erratum_forbids() {
    for name in callgraph::IMAGES {
        assert_eq!(callgraph::errata(&images(), name).unwrap(), [""; 0], "{name}");
    }
}

/// The clock of the ST-LINK comes seconds after the supply: a cold start, not a crash.
#[test]
fn a_cold_start_with_a_late_clock_is_a_power_on() {
    for seconds in ["0.5", "2.5", "7"] {
        let mut world = world(&format!("--bitrate 1000 --fault no-crystal@0..{seconds}"));
        let summary = run(&mut world, SECOND * 10);
        let log = log(&mut world);
        let heard = &summary.nodes[0].heard;
        assert_eq!((heard.boot_ups, heard.emcys), (1, 0), "{seconds} s: {log}");
        assert!(log.contains("reset by power on"), "{seconds} s: {log}");
        assert_eq!(log.contains("the clock on OSC_IN was late"), seconds != "0.5", "{seconds} s: {log}");
    }
}

/// Without a battery the backup SRAM decays in part: the marks may live while the content does not.
#[test]
fn memory_that_has_decayed_in_part_is_lost_and_not_damaged() {
    let (mut world, master) = start("--fault battery-weak@0");
    world.take_log();
    cycle_power(&mut world);
    let log = log(&mut world);
    assert!(log.contains("no battery has kept") && !log.contains("is damaged"), "{log}");
    let state = read(&mut world, &master, SENSOR_STATE);
    assert_ne!(state & UNREFERENCED, 0, "{state:02X}h, alarms {:04X}h", read(&mut world, &master, ALARMS));
}

/// The controller does not leave the bus, as with RX held dominant: it is reset, and the node is not.
#[test]
fn a_controller_that_does_not_leave_the_bus_is_reset() {
    let mut world = running();
    let master = Master::join(&mut world);
    assert_eq!(read(&mut world, &master, CAN_RESETS), 0);
    world.machine(0).peripherals_mut().lose(Loss::LeaveBus, 1);
    master.send(&mut world, 0, &[0x82, 1]);
    world.run_until(world.now() + Time::from_millis(200));
    let summary = run(&mut world, SECOND);
    assert!(summary.nodes[0].incidents.is_empty(), "{summary}");
    assert_eq!(summary.nodes[0].heard.boot_ups, 2, "{summary}");
    assert_eq!(read(&mut world, &master, CAN_RESETS), 1);
    assert!(log(&mut world).contains("lost events of kind 9: 1"));
}

/// A FIFO that releases no mailbox for 20 ms: the interrupt does not wait for it, the node continues and counts the event.
#[test]
fn a_mailbox_that_is_released_late_costs_no_reset() {
    const LATE: u32 = 36_000 * 20;
    let mut world = running();
    let master = Master::join(&mut world);
    let lost = read(&mut world, &master, LOST_FRAMES);
    world.machine(0).peripherals_mut().can1_mut().release_after(LATE);
    master.send(&mut world, 0x000, &[1, 1]);
    world.run_until(world.now() + Time::from_millis(15));
    world.machine(0).peripherals_mut().can1_mut().release_after(0);
    let summary = run(&mut world, SECOND);
    assert!(summary.nodes[0].incidents.is_empty(), "{summary}");
    assert_eq!(summary.nodes[0].heard.boot_ups, 1, "{summary}");
    assert!(read(&mut world, &master, LOST_FRAMES) > lost, "{summary}");
}

/// The oscillator of the watchdog has 17 to 47 kHz: within this range the watchdog ends a task that hangs after the same
/// number of its cycles, also when the long time-out of an erase has been in force.
#[test]
fn the_watchdog_keeps_its_time_out_with_every_oscillator_and_after_an_erase() {
    for lsi in [17_000, 32_000, 47_000] {
        for erases in [0, 1] {
            let mut world = world(&format!("--bitrate 1000 --lsi {lsi}"));
            world.run_until(SECOND);
            let master = Master::join(&mut world);
            master.send(&mut world, 0, &PRE_OPERATIONAL);
            let before = read(&mut world, &master, ERASES);
            let is_done = |world: &mut World| read(world, &master, ERASES) >= before + erases;
            for number in 1..100 {
                if is_done(&mut world) {
                    break;
                }
                let _ = save_change(&mut world, &master, number);
                world.run_until(world.now() + Time::from_millis(50));
            }
            assert!(is_done(&mut world), "no page was erased");
            world.run_until(world.now() + Time::from_millis(500));
            assert!(world.machine(0).incidents().is_empty(), "{lsi} Hz: a reset by a save");
            let begin = world.now();
            run_broken(&mut world, TIM2, BRANCH_TO_ITSELF);
            let seen = (world.now() - begin).as_secs_f64() * 1000.0;
            let nominal = 200.0 * 32_000.0 / f64::from(lsi);
            // The tasks report every 20 ms.
            assert!(
                (nominal - 25.0..nominal + 5.0).contains(&seen),
                "{lsi} Hz, {erases} erases: {seen:.1} ms instead of {nominal:.1} ms"
            );
        }
    }
}

/// Each wait for a flag of the hardware has a bound: no loop has a register in its condition, and a loop without a
/// condition compares the time.
#[test]
fn no_wait_for_a_register_is_without_a_bound() {
    let folder = |path: &Path| -> Vec<PathBuf> {
        std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()).collect()
    };
    let sources = folder(Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../crates/bsp/src")));
    let files = sources.iter().flat_map(|path| if path.is_dir() { folder(path) } else { vec![path.clone()] });
    let mut unbounded = Vec::new();
    for file in files {
        let text = std::fs::read_to_string(&file).unwrap();
        let lines: Vec<&str> = text.lines().take_while(|line| *line != "#[cfg(test)]").collect();
        for (number, line) in (1..).zip(&lines) {
            let asks_register = line.trim_start().starts_with("while ") && line.contains("read()");
            let body =
                || lines[number..].iter().take_while(|next| next.trim() != "}" || next.starts_with("     "));
            let has_no_end = line.trim() == "loop {" && !body().any(|next| next.contains(">= latest"));
            if asks_register || has_no_end {
                unbounded.push(format!("{}:{number}: {}", file.display(), line.trim()));
            }
        }
    }
    assert_eq!(unbounded, [""; 0]);
}

/// The control block of the log lies where the bootloader has nothing, so a debug probe reads on through a reset.
#[test]
fn the_log_of_the_application_survives_the_bootloader() {
    let firmware = std::fs::read(images().join("firmware")).unwrap();
    let elf = object::File::parse(&*firmware).unwrap();
    let block = elf.symbols().find(|symbol| symbol.name() == Ok("_SEGGER_RTT")).expect("a log").address();
    let bootloader = std::fs::read(images().join("bootloader")).unwrap();
    let elf = object::File::parse(&*bootloader).unwrap();
    let end = elf.sections().map(|section| section.address() + section.size());
    // The retained words at the end of RAM belong to both.
    let end = end.filter(|end| (0x2000_0000..0x2001_FF00).contains(end)).max().unwrap();
    assert!(block >= end, "the log at {block:#x}, the bootloader up to {end:#x}");
}

/// The table of the documents has every item of the examination, each with a test that exists, a rule, a bring-up step, or
/// the first board.
#[test]
fn the_table_of_the_documents_is_complete() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let evidence = std::fs::read_to_string(root.join("../docs/evidence.md")).unwrap();
    let rows = evidence
        .lines()
        .skip_while(|line| *line != "## Silicon")
        .take_while(|line| *line != "## Lost events");
    let rows: Vec<&str> = rows.filter(|line| line.starts_with("| ") && !line.starts_with("| item")).collect();
    assert!(rows.len() >= 25, "{} rows", rows.len());
    let tests: String = std::fs::read_dir(root.join("tests/board"))
        .unwrap()
        .filter_map(|file| std::fs::read_to_string(file.unwrap().path()).ok())
        .collect();
    for row in rows {
        let last = row.trim_end_matches(" |").rsplit(" | ").next().unwrap();
        let places = ["`", "rule", "bring-up", "first board"];
        assert!(places.iter().any(|place| last.contains(place)), "{row}");
        for name in last.split('`').skip(1).step_by(2).filter(|name| !name.contains([':', '/', '.'])) {
            assert!(tests.contains(&format!("fn {name}(")), "{name} is no test: {row}");
        }
    }
}
