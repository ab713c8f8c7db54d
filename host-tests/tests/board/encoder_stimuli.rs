//! The stimuli of the encoders: other SSI formats, error bit and parity, a bouncing quadrature, cuts of the supply.

use sim::world::World;

use crate::encoder::{
    ALARMS, MULTI_TURN, POSITION, SENSOR_STATE, SENSOR_TYPE, UNREFERENCED, cycle_power, start, stimulate,
    wait,
};
use crate::support::{Master, read, run, write};

/// 2103h: bits of revolutions, bits of steps, coding, alarm bits, parity.
const WORD: u16 = 0x2103;
/// Bits of 210Bh: parity, and the encoder's own alarm.
const PARITY: u32 = 1 << 1;
const OWN_ALARM: u32 = 1 << 2;

/// A node with an absolute encoder of this format on both sides.
fn absolute(format: &str, word: [u32; 5]) -> (World, Master) {
    let (mut world, master) = start("");
    stimulate(&mut world, "ssi", format);
    write(&mut world, &master, SENSOR_TYPE, 1, MULTI_TURN);
    for (sub, value) in (1..).zip(word) {
        write(&mut world, &master, (WORD, sub), 1, value);
    }
    assert_eq!(master.ask(&mut world, 1, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e'])[0], 0x60);
    cycle_power(&mut world);
    (world, master)
}

#[test]
fn every_format_of_the_simulator_is_read_with_the_same_settings() {
    for (format, word) in [
        ("12+13,gray", [12, 13, 1, 0, 0]),
        ("12+12,binary,error,even", [12, 12, 0, 1, 1]),
        ("10+14,gray,odd", [10, 14, 1, 0, 2]),
    ] {
        let (mut world, master) = absolute(format, word);
        stimulate(&mut world, "shaft", "ramp:0,3.25,0.5");
        wait(&mut world, 600);
        let expected = (3.25 * f64::from(1 << word[1])) as u32;
        assert_eq!(read(&mut world, &master, POSITION), expected, "{format}");
        assert_eq!(read(&mut world, &master, SENSOR_STATE), 0, "{format}");
    }
}

#[test]
fn the_error_bit_and_a_wrong_parity_are_reported_and_end() {
    let (mut world, master) = absolute("12+12,binary,error,even", [12, 12, 0, 1, 1]);
    for (fault, bit) in [("ssi-error", OWN_ALARM), ("ssi-parity", PARITY)] {
        stimulate(&mut world, "fault", &format!("{fault}:on"));
        wait(&mut world, 50);
        assert_ne!(read(&mut world, &master, SENSOR_STATE) & bit, 0, "{fault}");
        assert_ne!(read(&mut world, &master, ALARMS), 0, "{fault}");
        stimulate(&mut world, "fault", &format!("{fault}:off"));
        wait(&mut world, 300);
        assert_eq!(read(&mut world, &master, SENSOR_STATE) & bit, 0, "{fault}");
    }
}

#[test]
fn a_bouncing_encoder_stays_within_one_step() {
    let (mut world, master) = start("");
    stimulate(&mut world, "shaft", "ramp:0,0.5,0.3");
    wait(&mut world, 500);
    let before = read(&mut world, &master, POSITION);
    stimulate(&mut world, "fault", "bounce:on");
    let mut seen = Vec::new();
    for _ in 0..100 {
        wait(&mut world, 3);
        seen.push(read(&mut world, &master, POSITION).wrapping_sub(before).cast_signed());
    }
    assert!(seen.iter().all(|moved| (0..=1).contains(moved)), "{seen:?}");
    assert!(seen.contains(&0) && seen.contains(&1), "it bounces: {seen:?}");
    stimulate(&mut world, "fault", "bounce:off");
    wait(&mut world, 50);
    assert_eq!(read(&mut world, &master, POSITION), before, "no step is lost");
    assert_eq!(read(&mut world, &master, SENSOR_STATE), UNREFERENCED);
}

/// With a battery a counted position is kept through a cut of the supply; without one it is an alarm.
#[test]
fn a_cut_of_the_supply_by_command_keeps_the_position_with_a_battery() {
    for (battery, is_kept) in [("on", true), ("off", false)] {
        let (mut world, master) = start("");
        stimulate(&mut world, "shaft", "const:1.5");
        wait(&mut world, 100);
        // The position is right from now on.
        write(&mut world, &master, (0x6003, 0), 4, 1000);
        let flag = if is_kept { "off" } else { "on" };
        stimulate(&mut world, "fault", &format!("battery-empty:{flag}"));
        let starts = run(&mut world, canbus::Time::from_millis(300)).nodes[0].heard.boot_ups;
        stimulate(&mut world, "power", "off:0.5");
        wait(&mut world, 2000);
        let heard = run(&mut world, canbus::Time::from_millis(10)).nodes[0].heard.boot_ups;
        assert_eq!(heard, starts + 1, "battery {battery}");
        let alarms = read(&mut world, &master, ALARMS);
        assert_eq!(alarms == 0, is_kept, "battery {battery}: alarms {alarms:04X}h");
        if is_kept {
            assert_eq!(read(&mut world, &master, POSITION), 1000);
        }
    }
}
