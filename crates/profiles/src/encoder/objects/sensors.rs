//! Objects 2100h to 2106h: the description of the sensors, in every personality that measures positions.

use core::num::{NonZeroU16, NonZeroU32};

use crate::encoder::{ChannelParameters, Coding, Format, Limits, Parameters, Parity, SensorType};
use canopen::dictionary::{Dictionary, Field};

/// The places of these objects in the image.
#[derive(Debug)]
pub(crate) struct Sensors {
    channels: [Channel; 2],
    format: [Field; 5],
    index: Field,
    limits: [Field; 4],
    operating_time_limit: Field,
}

#[derive(Debug)]
struct Channel {
    kind: Field,
    resolution: Field,
    counted: Field,
    fastest: Field,
}

impl Channel {
    const fn new(d: &Dictionary, sub: u8) -> Channel {
        Channel {
            kind: d.field(0x2100, sub),
            resolution: d.field(0x2101, sub),
            counted: d.field(0x2102, sub),
            fastest: d.field(0x2104, sub),
        }
    }

    fn parameters(&self, image: &[u8]) -> ChannelParameters {
        ChannelParameters {
            kind: SensorType::from_code(self.kind.u8(image)),
            resolution: NonZeroU32::new(self.resolution.u32(image)).unwrap_or(NonZeroU32::MIN),
            counted: NonZeroU16::new(self.counted.u16(image)).unwrap_or(NonZeroU16::MIN),
            fastest: self.fastest.u32(image),
            ..ChannelParameters::default()
        }
    }
}

impl Sensors {
    pub(crate) const fn new(d: &Dictionary) -> Sensors {
        Sensors {
            channels: [Channel::new(d, 1), Channel::new(d, 2)],
            format: [
                d.field(0x2103, 1),
                d.field(0x2103, 2),
                d.field(0x2103, 3),
                d.field(0x2103, 4),
                d.field(0x2103, 5),
            ],
            index: d.field(0x2105, 0),
            limits: [d.field(0x2106, 1), d.field(0x2106, 2), d.field(0x2106, 3), d.field(0x2106, 4)],
            operating_time_limit: d.field(0x2106, 5),
        }
    }

    /// The parameters in these objects. All other parameters have their defaults; an impossible frame is replaced by
    /// [`Format::COMMON`].
    pub(crate) fn parameters(&self, image: &[u8]) -> Parameters {
        let [lowest_supply, highest_supply, highest_current, lowest_battery] =
            self.limits.map(|at| at.u16(image));
        let operating_time = self.operating_time_limit.u32(image);
        Parameters {
            channels: self.channels.each_ref().map(|channel| channel.parameters(image)),
            format: self.format(image).unwrap_or(Format::COMMON),
            index: self.index.u8(image) != 0,
            limits: Limits { lowest_supply, highest_supply, highest_current, lowest_battery, operating_time },
            ..Parameters::default()
        }
    }

    /// Whether 2103h describes a possible frame.
    pub(crate) fn has_format(&self, image: &[u8]) -> bool {
        self.format(image).is_some()
    }

    fn format(&self, image: &[u8]) -> Option<Format> {
        let [revolutions, steps, coding, alarm, parity] = self.format.map(|at| at.u8(image));
        let coding = if coding == 0 { Coding::Binary } else { Coding::Gray };
        let parity = match parity {
            0 => Parity::None,
            1 => Parity::Even,
            _ => Parity::Odd,
        };
        Format::new(revolutions, steps, coding, alarm != 0, parity)
    }
}
