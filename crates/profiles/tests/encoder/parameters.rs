//! How parameters describe the sensors, and the parts of the snapshot that depend on parameters alone.

use profiles::encoder::{
    CODE_SEQUENCE, COMMISSIONING, Command, DIRECTION, Parameters, SCALING, SensorType, Snapshot,
};

use crate::bench::{Bench, one, two};

const SHAFT: SensorType = SensorType::IncrementalCounted;
const ROD: SensorType = SensorType::LinearIncremental;

#[test]
fn the_encoder_type_is_that_of_the_sensor_or_of_two() {
    let mut none = one(SHAFT);
    none.channels[0].kind = None;
    assert_eq!(none.encoder_type(), 0);
    assert_eq!([one(SHAFT), one(ROD), two(SHAFT, ROD)].map(|own| own.encoder_type()), [5, 6, 10]);
    let mut second = two(SHAFT, ROD);
    second.channels[0].kind = None;
    assert_eq!(second.encoder_type(), 6);
}

#[test]
fn parameters_beyond_a_sensor_are_refused() {
    // 4096 steps a revolution and 4096 revolutions; 8192 steps, once; steps of 4096 nm.
    let (fine, coarse) = (one(SHAFT), two(SHAFT, SensorType::SingleTurn));
    let rod = Parameters { step: 10_000, ..two(SHAFT, ROD) };
    for parameters in [fine, coarse, rod] {
        let scaled =
            |per_revolution, range| Parameters { operating: SCALING, per_revolution, range, ..parameters };
        assert!(
            scaled(u32::MAX, u32::MAX).is_consistent(),
            "the whole of UNSIGNED32 (CiA 406, 7.2.2 and 7.2.3)"
        );
        assert!(!scaled(0, 1).is_consistent() && !scaled(1, 0).is_consistent());
    }
    assert!([1, 4095, u32::MAX].iter().all(|step| Parameters { step: *step, ..rod }.is_consistent()));
}

#[test]
fn the_operating_status_has_the_bits_that_mean_something_to_the_sensors() {
    for (parameters, active) in [
        (one(SHAFT), CODE_SEQUENCE),
        (two(SHAFT, SHAFT), CODE_SEQUENCE),
        (one(ROD), DIRECTION),
        (two(SHAFT, ROD), CODE_SEQUENCE | DIRECTION),
    ] {
        assert_eq!(parameters.directions(), active);
        assert_eq!(parameters.operating_status(), COMMISSIONING, "nothing is asked for");
        let all = Parameters { operating: u16::MAX, ..parameters };
        assert_eq!(all.operating_status(), COMMISSIONING | SCALING | active);
        let nothing = Parameters { range: 0, ..all };
        assert_eq!(nothing.operating_status(), COMMISSIONING | active, "no scaling that does not work");
    }
}

#[test]
fn the_snapshot_describes_the_first_sensor() {
    for (parameters, resolution, revolutions) in [
        (one(SensorType::MultiTurn), 8192, 4096),
        (two(SHAFT, SensorType::MultiTurn), 4096, 4096),
        (two(SensorType::SingleTurn, SHAFT), 8192, 1),
        (one(ROD), 4096, 1),
    ] {
        let parameters = Parameters { operating: CODE_SEQUENCE | DIRECTION, ..parameters };
        let snapshot = Bench::new(parameters).stay();
        assert_eq!((snapshot.resolution, snapshot.revolutions), (resolution, revolutions));
        assert_eq!(snapshot.operating_status, parameters.operating_status());
    }
}

#[test]
fn a_channel_that_is_not_used_knows_of_its_preset_all_the_same() {
    let mut parameters = one(SHAFT);
    parameters.channels[1].preset = Command { value: 5, count: 3 };
    let Snapshot { channels: [_, unused], .. } = Bench::new(parameters).stay();
    assert_eq!((unused.presets, unused.position), (3, 0));
}
