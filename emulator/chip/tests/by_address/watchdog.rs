//! The independent watchdog, IWDG.

use canbus::Time;
use chip::{Board, Effect, Peripherals, Stm32f4, Variant};

use crate::support::{RCC, Rig};

const KR: u32 = 0x4000_3000;
const PR: u32 = KR + 0x04;
const RLR: u32 = KR + 0x08;
const SR: u32 = KR + 0x0C;

/// Starts the watchdog with the settings of the firmware: prescaler 16, reload 199, a tick of 0.5 ms.
fn start(rig: &mut Rig) {
    rig.write(KR, 0xCCCC);
    rig.write(KR, 0x5555);
    rig.write(PR, 2);
    rig.write(RLR, 199);
    while rig.read(SR) != 0 {
        rig.wait(Time::from_micros(10));
    }
    rig.write(KR, 0xAAAA);
}

#[test]
fn it_bites_after_its_time() {
    let mut rig = Rig::new();
    start(&mut rig);
    assert_eq!(rig.read(RCC + 0x74) & 1, 1, "it has turned on the LSI");
    let fed = rig.now;
    rig.run_to(fed + Time(Time::from_millis(100).0 - 1));
    assert!(!rig.effects.contains(&Effect::Reset));
    rig.run_to(fed + Time::from_millis(100));
    assert!(rig.effects.contains(&Effect::Reset));
    rig.chip.reset(false, rig.now);
    assert_eq!(
        rig.read(RCC + 0x74) >> 24,
        0x0E | 0x20 | 0x04,
        "IWDGRSTF and PINRSTF beside those of power-on"
    );
    rig.wait(Time::from_millis(1000));
    assert_eq!(
        rig.effects.iter().filter(|&effect| *effect == Effect::Reset).count(),
        1,
        "the reset stops it"
    );
}

#[test]
fn it_is_quiet_while_fed() {
    let mut rig = Rig::new();
    start(&mut rig);
    for _ in 0..50 {
        rig.wait(Time::from_millis(99));
        rig.write(KR, 0xAAAA);
    }
    assert!(!rig.effects.contains(&Effect::Reset));
}

#[test]
fn an_update_takes_five_cycles_of_the_lsi() {
    let mut rig = Rig::new();
    rig.write(KR, 0x5555);
    rig.write(PR, 3);
    rig.write(RLR, 0x123);
    assert_eq!(rig.read(SR), 0b11);
    // 5 / 32 kHz = 156.25 us.
    rig.wait(Time::from_micros(156));
    assert_eq!(rig.read(SR) & 1, 1);
    rig.wait(Time::from_micros(1));
    assert_eq!(rig.read(SR), 0);
}

#[test]
fn its_registers_are_locked_without_the_key() {
    let mut rig = Rig::new();
    rig.write(PR, 5);
    rig.write(RLR, 1);
    assert_eq!((rig.read(PR), rig.read(RLR)), (0, 0xFFF));
    rig.write(KR, 0x5555);
    rig.write(KR, 0xAAAA);
    rig.write(RLR, 1);
    assert_eq!(rig.read(RLR), 0xFFF, "any other key locks again");
}

/// A chip whose LSI has this frequency.
fn with_lsi(lsi: u32) -> Rig {
    let mut rig = Rig::new();
    rig.chip = Stm32f4::new(Variant::F446, Board { lsi, ..Board::default() });
    rig
}

#[test]
fn each_chip_has_an_lsi_of_its_own() {
    for (lsi, least) in [(17_000, 188_200), (32_000, 100_000), (47_000, 68_000)] {
        let mut rig = with_lsi(lsi);
        start(&mut rig);
        let fed = rig.now;
        rig.run_to(fed + Time::from_micros(least - 100));
        assert!(!rig.effects.contains(&Effect::Reset), "{lsi} Hz");
        rig.run_to(fed + Time::from_micros(least + 200));
        assert!(rig.effects.contains(&Effect::Reset), "{lsi} Hz");
    }
}

/// While RVU is set, a reload takes the value before; while PVU is set, the count continues with the prescaler before.
#[test]
fn a_new_value_has_no_effect_before_its_update() {
    let mut rig = Rig::new();
    start(&mut rig);
    rig.write(KR, 0x5555);
    rig.write(RLR, 9);
    rig.write(KR, 0xAAAA);
    let fed = rig.now;
    rig.run_to(fed + Time::from_millis(99));
    assert!(!rig.effects.contains(&Effect::Reset), "the reload took the old value: 100 ms");
    rig.write(KR, 0xAAAA);
    let fed = rig.now;
    rig.write(KR, 0x5555);
    rig.write(PR, 0);
    rig.run_to(fed + Time(Time::from_micros(156).0 + Time::from_micros(1234).0));
    assert!(!rig.effects.contains(&Effect::Reset), "10 ticks of 125 us after the update");
    rig.run_to(fed + Time::from_micros(1410));
    assert!(rig.effects.contains(&Effect::Reset));
}
