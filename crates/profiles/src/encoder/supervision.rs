//! Alarms, warnings and fault conditions: objects 6503h to 6506h.

use super::input::{SENSOR_POSITION_ERROR, SENSOR_TOO_FAST, SENSOR_UNREFERENCED};
use super::{ChannelValues, OperatingTime};
use crate::board::Board;

/// Alarm bit 0: position error.
pub const ALARM_POSITION: u16 = 1 << 0;
/// Alarm bit 1: the commissioning diagnostic has failed.
pub const ALARM_COMMISSIONING: u16 = 1 << 1;
/// Supported alarms (6504h).
pub const SUPPORTED_ALARMS: u16 = ALARM_POSITION | ALARM_COMMISSIONING;

/// Warning bit 0: frequency exceeded.
pub const WARNING_FREQUENCY: u16 = 1 << 0;
/// Warning bit 2: the last reset came from the watchdog.
pub const WARNING_WATCHDOG: u16 = 1 << 2;
/// Warning bit 3: operating time limit.
pub const WARNING_OPERATING_TIME: u16 = 1 << 3;
/// Warning bit 4: battery charge too low.
pub const WARNING_BATTERY: u16 = 1 << 4;
/// Warning bit 5: reference point not reached.
pub const WARNING_REFERENCE: u16 = 1 << 5;
/// Warning bit 12 (manufacturer): a speed value (6030h) is at a limit of INTEGER16.
pub const WARNING_SPEED: u16 = 1 << 12;
/// Supported warnings (6506h), apart from the battery (bit 4), which is supported on boards that measure it. The light
/// reserve (bit 1) is never supported: neither kind of input shows it.
pub const SUPPORTED_WARNINGS: u16 =
    WARNING_FREQUENCY | WARNING_WATCHDOG | WARNING_OPERATING_TIME | WARNING_REFERENCE | WARNING_SPEED;

/// Supported warnings (6506h) on this board.
pub(super) fn supported_warnings(board: &Board) -> u16 {
    SUPPORTED_WARNINGS | flag(board.battery.is_some(), WARNING_BATTERY)
}

/// Milliseconds for which a supply must be out of its limits, or back within them, before the change counts.
const DEBOUNCE: u8 = 10;

/// Limits of the board's measurements, and of the operating time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Lowest supply of the sensors in mV.
    pub lowest_supply: u16,
    /// Highest supply of the sensors in mV.
    pub highest_supply: u16,
    /// Highest current of the sensors in mA.
    pub highest_current: u16,
    /// Lowest battery voltage in mV.
    pub lowest_battery: u16,
    /// Operating time in 0.1 h from which bit 3 of 6505h warns; 0 for no limit.
    pub operating_time: u32,
}

impl Default for Limits {
    /// For 5 V sensors and a lithium cell.
    fn default() -> Limits {
        let (lowest_supply, highest_supply) = (4500, 5500);
        Limits {
            lowest_supply,
            highest_supply,
            highest_current: 200,
            lowest_battery: 2400,
            operating_time: 0,
        }
    }
}

/// Fault conditions for emergency messages (CiA 406, 5.3).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[allow(clippy::struct_excessive_bools)] // Each field is a separate fault.
pub struct Conditions {
    /// 2110h, input current too high.
    pub current: bool,
    /// 3110h, input voltage out of range.
    pub voltage: bool,
    /// 5100h, hardware memory error: the retained state is damaged, or a memory test has failed.
    pub memory: bool,
    /// A sensor does not answer.
    pub sensor_break: bool,
    /// A sensor answers, but its position is wrong.
    pub position: bool,
}

/// A condition that must last before it counts.
#[derive(Clone, Copy, Debug, Default)]
struct Debounced {
    is_set: bool,
    other: u8,
}

impl Debounced {
    fn update(&mut self, now: bool) -> bool {
        if now == self.is_set {
            self.other = 0;
        } else if self.other < DEBOUNCE - 1 {
            self.other += 1;
        } else {
            *self = Debounced { is_set: now, other: 0 };
        }
        self.is_set
    }
}

/// Least time in milliseconds for which a position error is reported, so that a reader that takes only some samples
/// does not miss it.
const SHOWN: u8 = 100;

/// A condition that is reported for a while.
#[derive(Clone, Copy, Debug, Default)]
struct Stretched {
    left: u8,
}

impl Stretched {
    fn update(&mut self, now: bool) -> bool {
        self.left = if now { SHOWN } else { self.left.saturating_sub(1) };
        self.left > 0
    }
}

/// State of the supervision from sample to sample.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Supervision {
    alarms: u16,
    current: Debounced,
    voltage: Debounced,
    battery: Debounced,
    position: Stretched,
    is_damaged: bool,
    /// The operating time has reached its limit for the first time since power-on, and the limit has not been raised
    /// since.
    is_old: bool,
    has_been_old: bool,
}

impl Supervision {
    /// `is_damaged`: the retained state is damaged.
    pub(super) fn new(is_damaged: bool) -> Supervision {
        Supervision { is_damaged, ..Supervision::default() }
    }

    /// Clears alarms, until the next sample finds them again.
    pub(super) fn acknowledge(&mut self, mask: u16) {
        self.alarms &= !mask;
    }

    /// Object 6503h: present alarms, and past alarms that have not been acknowledged.
    pub(super) fn alarms(&mut self, channels: &[ChannelValues; 2]) -> u16 {
        let position = sensors(channels) & SENSOR_POSITION_ERROR != 0;
        let commissioning = either(channels, |channel| channel.commissioning.is_failure());
        self.alarms |= flag(position, ALARM_POSITION) | flag(commissioning, ALARM_COMMISSIONING);
        self.alarms
    }

    /// Object 6505h: warnings that are present now.
    pub(super) fn warnings(
        &mut self,
        channels: &[ChannelValues; 2],
        board: &Board,
        limits: &Limits,
        time: OperatingTime,
    ) -> u16 {
        let sensors = sensors(channels);
        let battery = board.battery.is_some_and(|voltage| voltage < limits.lowest_battery);
        let is_limited = |channel: &ChannelValues| matches!(channel.speed, i16::MIN | i16::MAX);
        flag(sensors & SENSOR_TOO_FAST != 0, WARNING_FREQUENCY)
            | flag(board.watchdog_reset, WARNING_WATCHDOG)
            | flag(self.is_too_old(limits, time), WARNING_OPERATING_TIME)
            | flag(self.battery.update(battery), WARNING_BATTERY)
            | flag(sensors & SENSOR_UNREFERENCED != 0, WARNING_REFERENCE)
            | flag(either(channels, is_limited), WARNING_SPEED)
    }

    pub(super) fn conditions(
        &mut self,
        channels: &[ChannelValues; 2],
        board: &Board,
        limits: &Limits,
    ) -> Conditions {
        let supplies = limits.lowest_supply..=limits.highest_supply;
        let current = board.current.is_some_and(|current| current > limits.highest_current);
        let voltage = board.supply.is_some_and(|supply| !supplies.contains(&supply));
        let (sensor_break, is_wrong) =
            if sensors(channels) & SENSOR_POSITION_ERROR == 0 { (false, false) } else { errors(channels) };
        Conditions {
            current: self.current.update(current),
            voltage: self.voltage.update(voltage),
            memory: self.is_damaged || board.memory_error,
            sensor_break,
            position: self.position.update(is_wrong),
        }
    }

    /// The operating time warning. It goes when the limit is raised, and returns only after the next power-on (CiA 406,
    /// 6505h).
    fn is_too_old(&mut self, limits: &Limits, time: OperatingTime) -> bool {
        let reached = limits.operating_time > 0 && time.tenths() >= limits.operating_time;
        self.is_old = reached && (self.is_old || !self.has_been_old);
        self.has_been_old |= self.is_old;
        self.is_old
    }
}

/// Whether a sensor does not answer, and whether a sensor answers with a wrong position.
#[inline(never)]
fn errors(channels: &[ChannelValues; 2]) -> (bool, bool) {
    let is_wrong =
        |channel: &ChannelValues| !channel.is_broken && channel.sensor_state & SENSOR_POSITION_ERROR != 0;
    (channels.iter().any(|channel| channel.is_broken), channels.iter().any(is_wrong))
}

/// Whether one of the channels is in this condition; computed without branches.
fn either(channels: &[ChannelValues; 2], is: impl Fn(&ChannelValues) -> bool) -> bool {
    let [first, second] = channels;
    is(first) | is(second)
}

fn sensors(channels: &[ChannelValues; 2]) -> u8 {
    let [first, second] = channels;
    first.sensor_state | second.sensor_state
}

fn flag(is_set: bool, mask: u16) -> u16 {
    if is_set { mask } else { 0 }
}
