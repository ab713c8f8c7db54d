//! The sensor of a channel: encoder types (1000h) and their resolutions (6501h, 6502h).

use core::num::{NonZeroU16, NonZeroU32, NonZeroU64};

use super::{Format, Native};

/// Bits of the timer that counts the quarter periods of an incremental encoder.
const COUNTER_BITS: u32 = 16;

/// The type of an encoder with one sensor: the codes 1 to 9 of object 1000h.
///
/// The type decides the source of the position: absolute encoders are read over SSI, incremental encoders are counted
/// by a timer. Types "with electronic counting" keep their count through a loss of power.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SensorType {
    /// Absolute rotary, single-turn.
    SingleTurn = 1,
    /// Absolute rotary, multi-turn.
    MultiTurn = 2,
    /// Absolute rotary, single-turn, with electronic turn-count.
    SingleTurnCounted = 3,
    /// Incremental rotary.
    Incremental = 4,
    /// Incremental rotary with electronic counting.
    IncrementalCounted = 5,
    /// Incremental linear.
    LinearIncremental = 6,
    /// Incremental linear with electronic counting.
    LinearIncrementalCounted = 7,
    /// Absolute linear.
    LinearAbsolute = 8,
    /// Absolute linear with cyclic coding.
    LinearCyclic = 9,
}

impl SensorType {
    /// The type with this code.
    #[must_use]
    pub fn from_code(code: u8) -> Option<SensorType> {
        Some(match code {
            1 => SensorType::SingleTurn,
            2 => SensorType::MultiTurn,
            3 => SensorType::SingleTurnCounted,
            4 => SensorType::Incremental,
            5 => SensorType::IncrementalCounted,
            6 => SensorType::LinearIncremental,
            7 => SensorType::LinearIncrementalCounted,
            8 => SensorType::LinearAbsolute,
            9 => SensorType::LinearCyclic,
            _ => return None,
        })
    }

    /// The code of the type.
    #[must_use]
    pub fn code(self) -> u8 {
        self as u8
    }

    /// Whether the encoder is linear, not rotary.
    #[must_use]
    pub fn is_linear(self) -> bool {
        self.code() >= SensorType::LinearIncremental.code()
    }

    /// Whether the encoder is read over SSI, not counted.
    #[must_use]
    pub fn is_absolute(self) -> bool {
        !matches!(
            self,
            SensorType::Incremental
                | SensorType::IncrementalCounted
                | SensorType::LinearIncremental
                | SensorType::LinearIncrementalCounted
        )
    }

    /// Whether the type counts turns or steps that its readings do not show, so that after a loss of power only
    /// retained memory tells its position.
    #[must_use]
    pub fn is_counted(self) -> bool {
        self.is_retained() && self != SensorType::MultiTurn
    }

    /// Whether the type continues from its last position after a loss of power. A multi-turn encoder does too: the
    /// range (6002h) need not divide the number of its positions, so the number of wraps matters.
    #[must_use]
    pub fn is_retained(self) -> bool {
        matches!(
            self,
            SensorType::MultiTurn
                | SensorType::SingleTurnCounted
                | SensorType::IncrementalCounted
                | SensorType::LinearIncrementalCounted
                | SensorType::LinearCyclic
        )
    }
}

/// A sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sensor {
    /// Type.
    pub kind: SensorType,
    /// Incremental: steps per revolution, four a line. Linear: nm a step. Absolute rotary: in the format instead.
    pub resolution: NonZeroU32,
    /// Revolutions (types 3 and 5) or periods of the code (type 9) that the electronic count distinguishes.
    pub counted: NonZeroU16,
    /// Frame of an absolute encoder.
    pub format: Format,
    /// Whether an incremental encoder has an index.
    pub index: bool,
    /// The most steps in a millisecond that the sensor can follow; 0 for no limit.
    pub fastest: u32,
}

impl Sensor {
    /// Whether readings of both sensors mean the same, so that a position can continue from one to the other.
    #[must_use]
    pub fn is_like(&self, other: &Sensor) -> bool {
        let is_same_code = !self.kind.is_absolute() || self.format == other.format;
        self.kind == other.kind && self.resolution() == other.resolution() && is_same_code
    }

    /// The resolution of the sensor.
    #[must_use]
    #[inline(never)]
    pub fn native(&self) -> Native {
        let Sensor { resolution, counted, format, .. } = *self;
        let per_revolution = power(format.step_bits());
        let code = power64(format.position_bits());
        match self.kind {
            SensorType::SingleTurn => Native::Rotary { per_revolution, revolutions: NonZeroU32::MIN },
            SensorType::MultiTurn => {
                Native::Rotary { per_revolution, revolutions: power(format.revolution_bits()) }
            }
            SensorType::SingleTurnCounted => Native::Rotary { per_revolution, revolutions: counted.into() },
            SensorType::Incremental => {
                Native::Rotary { per_revolution: resolution, revolutions: NonZeroU32::MIN }
            }
            SensorType::IncrementalCounted => {
                Native::Rotary { per_revolution: resolution, revolutions: counted.into() }
            }
            SensorType::LinearIncremental | SensorType::LinearIncrementalCounted => {
                Native::Linear { step: resolution, steps: power64(32) }
            }
            SensorType::LinearAbsolute => Native::Linear { step: resolution, steps: code },
            SensorType::LinearCyclic => {
                Native::Linear { step: resolution, steps: code.saturating_mul(counted.into()) }
            }
        }
    }

    /// Number of bits of the counter or code that wraps.
    #[must_use]
    pub fn bits(&self) -> u32 {
        match self.kind {
            SensorType::SingleTurn | SensorType::SingleTurnCounted => self.format.step_bits(),
            kind if kind.is_absolute() => self.format.position_bits(),
            _ => COUNTER_BITS,
        }
    }

    /// 6501h: steps per revolution, or nm a step.
    #[must_use]
    pub fn resolution(&self) -> u32 {
        match self.native() {
            Native::Rotary { per_revolution, .. } => per_revolution.get(),
            Native::Linear { step, .. } => step.get(),
        }
    }

    /// 6502h: revolutions that the sensor distinguishes. CiA 406 allows 65 536, which UNSIGNED16 cannot hold; the value
    /// is then 65 535.
    #[must_use]
    pub fn revolutions(&self) -> u16 {
        match self.native() {
            Native::Rotary { revolutions, .. } => u16::try_from(revolutions.get()).unwrap_or(u16::MAX),
            Native::Linear { .. } => 1,
        }
    }
}

fn power(exponent: u32) -> NonZeroU32 {
    NonZeroU32::new(1 << exponent.min(31)).unwrap_or(NonZeroU32::MIN)
}

fn power64(exponent: u32) -> NonZeroU64 {
    NonZeroU64::new(1 << exponent.min(63)).unwrap_or(NonZeroU64::MIN)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_are_those_of_the_device_type() {
        for code in 0..=255 {
            let kind = SensorType::from_code(code);
            assert_eq!(kind.is_some(), (1..=9).contains(&code));
            assert!(kind.is_none_or(|kind| kind.code() == code));
        }
    }

    #[test]
    fn a_position_continues_between_sensors_with_equal_readings() {
        let encoder = Sensor {
            kind: SensorType::Incremental,
            resolution: NonZeroU32::new(4000).unwrap(),
            counted: NonZeroU16::new(100).unwrap(),
            format: Format::COMMON,
            index: true,
            fastest: 0,
        };
        let rod = Sensor { kind: SensorType::LinearAbsolute, ..encoder };
        let finer = NonZeroU32::new(4001).unwrap();
        let format =
            Format::new(12, 13, super::super::Coding::Binary, false, super::super::Parity::None).unwrap();
        for sensor in [encoder, rod] {
            let (counted, index, fastest) = (NonZeroU16::MIN, false, 5);
            assert!(sensor.is_like(&Sensor { counted, index, fastest, ..sensor }));
            assert!(!sensor.is_like(&Sensor { resolution: finer, ..sensor }));
            let of_another_code = Sensor { format, ..sensor };
            assert_eq!(sensor.is_like(&of_another_code), !sensor.kind.is_absolute());
        }
        assert!(!encoder.is_like(&Sensor { kind: SensorType::IncrementalCounted, ..encoder }));
    }

    #[test]
    fn every_type_has_its_resolution() {
        let expected = [
            (SensorType::SingleTurn, 8192, 1, 13),
            (SensorType::MultiTurn, 8192, 4096, 25),
            (SensorType::SingleTurnCounted, 8192, 100, 13),
            (SensorType::Incremental, 4000, 1, 16),
            (SensorType::IncrementalCounted, 4000, 100, 16),
            (SensorType::LinearIncremental, 4000, 1, 16),
            (SensorType::LinearIncrementalCounted, 4000, 1, 16),
            (SensorType::LinearAbsolute, 4000, 1, 25),
            (SensorType::LinearCyclic, 4000, 1, 25),
        ];
        for (kind, resolution, revolutions, bits) in expected {
            let sensor = Sensor {
                kind,
                resolution: NonZeroU32::new(4000).unwrap(),
                counted: NonZeroU16::new(100).unwrap(),
                format: Format::COMMON,
                index: true,
                fastest: 0,
            };
            assert_eq!(
                (sensor.resolution(), sensor.revolutions(), sensor.bits()),
                (resolution, revolutions, bits)
            );
        }
    }
}
