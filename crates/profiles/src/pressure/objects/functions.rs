//! Functions on the process values, between two TPDOs: change threshold (6133h), lowest and highest value (2211h, 2212h),
//! and the alarm function block of CiA 404 (6503h to 6611h).
//!
//! The public database of CiA 404 names the objects of the block and leaves open what their values mean. Here 6508h is
//! 0 off, 1 above the limit, 2 below it; 6509h is 0 for a state that follows the value, 1 for one that stays until a
//! reset; 650Ah and 650Bh, which the database has no name for, are limit and hysteresis.

use canopen::dictionary::{Access, Dictionary, Field, Group, Mapping, Object, Type};

use crate::last_sent::LastSent;
use crate::older_samples::OlderSamples;
use crate::pressure::ChannelValues;

/// Number of alarms, at most 8.
pub(super) const ALARMS: usize = 4;

const fn alarm(index: u16, sub: u8, name: &'static str, kind: Type) -> Object {
    Object::new(index, sub, name, kind, Access::ReadWrite).stored(Group::Application)
}

const fn state(sub: u8, name: &'static str) -> Object {
    Object::new(0x650D, sub, name, Type::Unsigned8, Access::ReadOnly)
}

const fn command(index: u16, sub: u8, name: &'static str) -> Object {
    Object::new(index, sub, name, Type::Unsigned8, Access::WriteOnly)
}

/// The same object for each alarm.
macro_rules! alarms {
    ($index:literal, $what:literal, $row:expr) => {
        [
            Object::highest($index, 4, concat!("AL ", $what)),
            $row(1, concat!("AL 1 ", $what)),
            $row(2, concat!("AL 2 ", $what)),
            $row(3, concat!("AL 3 ", $what)),
            $row(4, concat!("AL 4 ", $what)),
        ]
    };
}

const fn link(sub: u8, name: &'static str) -> Object {
    alarm(0x6503, sub, name, Type::Unsigned32).handled()
}

const fn kind(sub: u8, name: &'static str) -> Object {
    alarm(0x6508, sub, name, Type::Unsigned8).limits(0, 2)
}

const fn action(sub: u8, name: &'static str) -> Object {
    alarm(0x6509, sub, name, Type::Unsigned8).limits(0, 1)
}

const fn limit(sub: u8, name: &'static str) -> Object {
    alarm(0x650A, sub, name, Type::Real32)
}

const fn hysteresis(sub: u8, name: &'static str) -> Object {
    alarm(0x650B, sub, name, Type::Real32).handled()
}

const fn reset(sub: u8, name: &'static str) -> Object {
    command(0x650E, sub, name)
}

/// 6503h to 6611h.
pub(crate) const ALARM_BLOCK: &[Object] = canopen::rows!(
    alarms!(0x6503, "link input", link),
    alarms!(0x6508, "type", kind),
    alarms!(0x6509, "action", action),
    alarms!(0x650A, "limit", limit),
    alarms!(0x650B, "hysteresis", hysteresis),
    alarms!(0x650D, "state", state),
    alarms!(0x650E, "reset", reset),
    [
        Object::highest(0x6600, 1, "AL states"),
        Object::new(0x6600, 1, "AL 1 to 8 state", Type::Unsigned8, Access::ReadOnly).mappable(Mapping::Tpdo),
        Object::new(0x6602, 0, "AL general state", Type::Unsigned8, Access::ReadOnly),
        command(0x6610, 0, "AL general reset"),
        Object::highest(0x6611, 1, "AL resets"),
        command(0x6611, 1, "AL 1 to 8 reset"),
    ],
);

const fn extreme(index: u16, sub: u8, name: &'static str) -> Object {
    Object::new(index, sub, name, Type::Real32, Access::ReadOnly).mappable(Mapping::Tpdo)
}

const fn tare(sub: u8, name: &'static str) -> Object {
    Object::new(0x2210, sub, name, Type::Real32, Access::ReadWrite).stored(Group::Application)
}

/// 2210h to 2213h: tare (found by 6139h), lowest and highest process value, and the command that forgets both: bit 0 for
/// the pressure, bit 1 for the temperature.
pub(crate) const EXTREMES: &[Object] = &[
    Object::highest(0x2210, 2, "Tare"),
    tare(1, "Pressure tare"),
    tare(2, "Temperature tare"),
    Object::highest(0x2211, 2, "Lowest process value"),
    extreme(0x2211, 1, "Lowest pressure process value"),
    extreme(0x2211, 2, "Lowest temperature process value"),
    Object::highest(0x2212, 2, "Highest process value"),
    extreme(0x2212, 1, "Highest pressure process value"),
    extreme(0x2212, 2, "Highest temperature process value"),
    command(0x2213, 0, "Restart of lowest and highest process value").limits(0, 3),
];

/// The places of one alarm.
#[derive(Clone, Copy, Debug)]
struct Alarm {
    link: Field,
    kind: Field,
    action: Field,
    limit: Field,
    hysteresis: Field,
    state: Field,
}

impl Alarm {
    const fn new(d: &Dictionary, shift: u16, sub: u8) -> Alarm {
        Alarm {
            link: d.field(0x6503 + shift, sub),
            kind: d.field(0x6508 + shift, sub),
            action: d.field(0x6509 + shift, sub),
            limit: d.field(0x650A + shift, sub),
            hysteresis: d.field(0x650B + shift, sub),
            state: d.field(0x650D + shift, sub),
        }
    }

    /// Whether the alarm is on for the value.
    fn is_on(&self, value: f32, was_on: bool, image: &[u8]) -> bool {
        let back = if was_on { self.hysteresis.f32(image) } else { 0.0 };
        let limit = self.limit.f32(image);
        match self.kind.u8(image) {
            1 => value > limit - back,
            2 => value < limit + back,
            _ => false,
        }
    }
}

/// The places of the functions.
#[derive(Debug)]
pub(super) struct Functions {
    alarms: [Alarm; ALARMS],
    states: Field,
    general: Field,
    pub(super) thresholds: [Field; 2],
    lowest: [Field; 2],
    highest: [Field; 2],
    shift: u16,
}

/// Their state.
#[derive(Debug)]
pub(super) struct States {
    /// The alarms whose value is beyond its limit, and those that have not been reset: one bit each.
    on: u8,
    latched: u8,
    pub(super) channels: [ChannelState; 2],
}

#[derive(Debug)]
pub(super) struct ChannelState {
    /// The process value when each TPDO was sent.
    pub(super) sent: LastSent,
    /// Lowest and highest value.
    extremes: Option<(f32, f32)>,
    /// Samples from before the last restart of the extremes.
    older: OlderSamples,
}

impl States {
    pub(super) const NEW: States = {
        const CHANNEL: ChannelState =
            ChannelState { sent: LastSent::NEW, extremes: None, older: OlderSamples::NONE };
        States { on: 0, latched: 0, channels: [CHANNEL; 2] }
    };

    /// Forgets the extremes of these channels, one bit each.
    fn restart(&mut self, channels: u8) {
        for (channel, bit) in self.channels.iter_mut().zip([1, 2]) {
            if channels & bit != 0 {
                (channel.extremes, channel.older) = (None, OlderSamples::BEGIN);
            }
        }
    }
}

impl Functions {
    pub(super) const fn new(d: &Dictionary, shift: u16) -> Functions {
        Functions {
            alarms: [
                Alarm::new(d, shift, 1),
                Alarm::new(d, shift, 2),
                Alarm::new(d, shift, 3),
                Alarm::new(d, shift, 4),
            ],
            states: d.field(0x6600 + shift, 1),
            general: d.field(0x6602 + shift, 0),
            thresholds: [d.field(0x6133 + shift, 1), d.field(0x6133 + shift, 2)],
            lowest: [d.field(0x2211, 1), d.field(0x2211, 2)],
            highest: [d.field(0x2212, 1), d.field(0x2212, 2)],
            shift,
        }
    }

    /// The channel that 6503h links to, from its mapping entry; `None` for any other value.
    fn linked(&self, entry: u32) -> Option<usize> {
        (1..=2)
            .find(|sub| entry == u32::from(0x6130 + self.shift) << 16 | sub << 8 | 0x20)
            .map(|sub| sub as usize - 1)
    }

    /// Whether 6503h takes this value.
    pub(super) fn can_link(&self, entry: u32) -> bool {
        entry == 0 || self.linked(entry).is_some()
    }

    /// Takes the values of a millisecond. A value that is not measured changes nothing.
    #[inline(never)]
    pub(super) fn follow(&self, values: [&ChannelValues; 2], states: &mut States, image: &mut [u8]) {
        for (channel, values) in states.channels.iter_mut().zip(values) {
            let value = values.process_value;
            if values.measured.is_some() {
                let (low, high) = channel.extremes.unwrap_or((value, value));
                channel.extremes = Some((low.min(value), high.max(value)));
            }
        }
        let places = self.lowest.iter().zip(&self.highest);
        for (channel, (lowest, highest)) in states.channels.iter_mut().zip(places) {
            let (low, high) = channel.extremes.unwrap_or_default();
            lowest.store(image, low.to_le_bytes());
            highest.store(image, high.to_le_bytes());
            if channel.older.are_left() {
                channel.extremes = None;
            }
            channel.older.take();
        }
        self.follow_alarms(values, states, image);
    }

    fn follow_alarms(&self, values: [&ChannelValues; 2], states: &mut States, image: &mut [u8]) {
        let mut shown = 0;
        for (alarm, bit) in self.alarms.iter().zip([1, 2, 4, 8]) {
            let linked = self.linked(alarm.link.u32(image)).and_then(|channel| values.get(channel));
            let was_on = states.on & bit != 0;
            let is_on = match linked {
                None => false,
                Some(values) if values.measured.is_none() => was_on,
                Some(values) => alarm.is_on(values.process_value, was_on, image),
            };
            states.on = states.on & !bit | if is_on { bit } else { 0 };
            let stays = alarm.action.u8(image) != 0 && linked.is_some();
            states.latched = if stays { states.latched | states.on & bit } else { states.latched & !bit };
            let is_shown = is_on || states.latched & bit != 0;
            alarm.state.store(image, [is_shown.into()]);
            shown |= if is_shown { bit } else { 0 };
        }
        self.states.store(image, [shown]);
        self.general.store(image, [(shown != 0).into()]);
    }
}

impl States {
    /// A client has written an object. `index` is without the shift.
    #[inline(never)]
    pub(super) fn written(&mut self, index: u16, sub: u8, value: u8) {
        let channels = if sub == 2 { 2 } else { 1 };
        match index {
            // Another unit, offset or tare: the extremes would be those of another value.
            0x6124..=0x6131 | 0x6139 | 0x2210 => self.restart(channels),
            0x2213 => self.restart(value),
            0x650E => self.latched &= !(1_u8.checked_shl(u32::from(sub).wrapping_sub(1)).unwrap_or(0)),
            0x6610 => self.latched = 0,
            0x6611 => self.latched &= !value,
            _ => {}
        }
    }
}
