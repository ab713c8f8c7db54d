//! The bits of the registers, as printed in the documents.

use profiles::encoder::{
    ALARM_COMMISSIONING, ALARM_POSITION, CODE_SEQUENCE, COMMISSIONING, Coding, DIRECTION, Format,
    OUT_OF_RANGE, OVERFLOW, Parity, SCALING, SENSOR_ALARM, SENSOR_HELD, SENSOR_IMPLAUSIBLE, SENSOR_INDEX,
    SENSOR_NO_SIGNAL, SENSOR_PARITY, SENSOR_POSITION_ERROR, SENSOR_TOO_FAST, SENSOR_UNREFERENCED,
    SUPPORTED_ALARMS, SUPPORTED_WARNINGS, UNDERFLOW, WARNING_BATTERY, WARNING_FREQUENCY,
    WARNING_OPERATING_TIME, WARNING_REFERENCE, WARNING_SPEED, WARNING_WATCHDOG,
};

#[test]
fn those_of_cia_406() {
    assert_eq!([CODE_SEQUENCE, COMMISSIONING, SCALING, DIRECTION], [1, 2, 4, 8], "6000h");
    assert_eq!([OUT_OF_RANGE, OVERFLOW, UNDERFLOW], [1, 2, 4], "6400h");
    assert_eq!([ALARM_POSITION, ALARM_COMMISSIONING], [1, 2], "6503h");
    assert_eq!(SUPPORTED_ALARMS, 0b11, "6504h");
    let warnings =
        [WARNING_FREQUENCY, WARNING_WATCHDOG, WARNING_OPERATING_TIME, WARNING_BATTERY, WARNING_REFERENCE];
    assert_eq!(warnings, [0x01, 0x04, 0x08, 0x10, 0x20], "6505h");
    assert_eq!(WARNING_SPEED, 0x1000, "6505h, manufacturer");
    assert_eq!(SUPPORTED_WARNINGS, 0x102D, "6506h: no light and no battery is measured");
}

/// The bits of 210Bh.
#[test]
fn those_of_the_sensor_state() {
    let bits = [
        SENSOR_NO_SIGNAL,
        SENSOR_PARITY,
        SENSOR_ALARM,
        SENSOR_IMPLAUSIBLE,
        SENSOR_INDEX,
        SENSOR_UNREFERENCED,
        SENSOR_TOO_FAST,
        SENSOR_POSITION_ERROR,
    ];
    assert_eq!(bits, [0x01, 0x02, 0x04, 0x08, 0x10, 0x20, 0x40, 0x80]);
    assert_eq!(SENSOR_HELD, 0b1011, "no signal, parity, implausible");
}

#[test]
fn the_common_frame_is_4096_revolutions_of_8192_steps_in_gray_code() {
    assert_eq!(Some(Format::COMMON), Format::new(12, 13, Coding::Gray, false, Parity::None));
}
