//! The words of virtual inputs (6010h) and virtual outputs (6011h), and the rules which lamp or input an output
//! addresses.
//!
//! ```text
//! byte 0          1            2         3        4        5
//! basic function  sub-function lifts     floor    doors    function data
//! ```
//!
//! Lifts have one bit each. The floor is 00h for the car and `FFh` for any floor. Doors are bits 0 to 3 (bits 4 to 7
//! are the destination doors of destination calls), `FFh` for any door. The sources of these facts are in
//! `docs/lift.md`.

/// A word of 48 bits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Word(pub [u8; 6]);

/// Any floor, any door.
const ANY: u8 = 0xFF;
/// Basic function of an output: a command of the call controller.
const COMMAND: u8 = 0x00;
/// Basic function of an output: a position indication.
const POSITION_INDICATION: u8 = 0x40;
/// Basic function of an input: a special function.
const SPECIAL: u8 = 0x0E;
/// Bits of the doors 1 to 4; in calls with a destination, the upper bits are the destination doors.
const SOURCE_DOORS: u8 = 0x0F;

impl Word {
    const fn function(self) -> u8 {
        self.0[0]
    }

    const fn sub_function(self) -> u8 {
        self.0[1]
    }

    const fn lifts(self) -> u8 {
        self.0[2]
    }

    const fn floor(self) -> u8 {
        self.0[3]
    }

    const fn doors(self) -> u8 {
        self.0[4]
    }

    const fn data(self) -> u8 {
        self.0[5]
    }

    const fn is_hall_call(self) -> bool {
        matches!(self.function(), 0x02..=0x04)
    }

    /// Hall, car and destination calls. The priority (standard, low, high) is part of the function.
    const fn is_call(self) -> bool {
        matches!(self.function(), 0x02..=0x0D)
    }

    /// The word with the state of an input: bits 0 and 1 of the function data.
    #[must_use]
    #[inline(never)]
    pub const fn with_state(self, is_set: bool) -> Word {
        let Word(mut bytes) = self;
        bytes[5] = bytes[5] & !0x03 | is_set as u8;
        Word(bytes)
    }

    /// Whether `output` addresses the lamp with this word.
    #[must_use]
    #[inline(never)]
    pub fn is_meant_by(self, output: Word) -> bool {
        if self.function() != output.function() || self.sub_function() != output.sub_function() {
            return false;
        }
        let have_lift = match self.function() {
            POSITION_INDICATION => self.lifts() == output.lifts(),
            _ => self.lifts() & output.lifts() != 0,
        };
        have_lift && self.shares_floor(output) && self.shares_door(output)
    }

    /// Whether `command`, a command of the call controller, asks the input with this word for its state.
    #[must_use]
    #[inline(never)]
    pub fn is_asked_by(self, command: Word) -> bool {
        let is_kind = match command.sub_function() {
            0x00 => true,
            0x01 => self.is_hall_call(),
            0x02 => self.function() == SPECIAL,
            0x03 => !self.is_call(),
            _ => false,
        };
        command.function() == COMMAND
            && is_kind
            && self.lifts() & command.lifts() != 0
            && self.shares_floor(command)
    }

    fn shares_floor(self, other: Word) -> bool {
        self.floor() == other.floor() || self.floor() == ANY || other.floor() == ANY
    }

    fn shares_door(self, other: Word) -> bool {
        let relevant = if matches!(self.function(), 0x05..=0x0D) { SOURCE_DOORS } else { ANY };
        self.doors() == ANY || other.doors() == ANY || self.doors() & other.doors() & relevant != 0
    }

    /// The doors of the lifts that the lamp with this word and `output` share: four bits for each lift.
    #[must_use]
    #[inline(never)]
    pub fn places(self, output: Word) -> u32 {
        let doors = match (self.doors(), output.doors()) {
            (ANY, doors) | (doors, ANY) => doors & SOURCE_DOORS,
            (own, others) => own & others & SOURCE_DOORS,
        };
        // Without a common door of this side, the lamp as a whole is one place.
        let doors = u32::from(if doors == 0 { SOURCE_DOORS } else { doors });
        let lifts = self.lifts() & output.lifts();
        (0..8).filter(|lift| lifts >> lift & 1 != 0).fold(0, |places, lift| places | doors << (4 * lift))
    }

    /// The light that an output asks for.
    #[must_use]
    pub const fn light(self) -> Light {
        let data = self.data();
        let (property, parameter) = (data >> 1 & 0x07, data >> 4 & 0x07);
        match (data & 0x01, property) {
            (0, _) => Light::OFF,
            (_, 3) => Light::flashing(parameter),
            _ => Light::ON,
        }
    }
}

/// Light of a lamp, in the codes of 2322h: 0 off, 10h to 17h flashing, any other value on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Light(pub u8);

impl Light {
    /// Not lit.
    pub const OFF: Light = Light(0);
    /// Lit.
    pub const ON: Light = Light(1);

    const fn flashing(parameter: u8) -> Light {
        Light(0x10 | parameter & 0x07)
    }

    /// Period of a flashing lamp in milliseconds.
    #[allow(clippy::indexing_slicing, reason = "three bits index eight periods")]
    #[must_use]
    pub const fn period(self) -> Option<u32> {
        const PERIODS: [u32; 8] = [100, 133, 200, 500, 666, 1000, 2000, 4000];
        if self.0 & 0xF8 == 0x10 { Some(PERIODS[(self.0 & 0x07) as usize]) } else { None }
    }

    /// Whether the lamp is lit at this millisecond.
    #[must_use]
    #[inline(never)]
    pub fn is_lit(self, millisecond: u32) -> bool {
        match self.period() {
            Some(period) => millisecond % period < period / 2,
            None => self != Light::OFF,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Car call, standard priority, lifts 1 and 2, in the car, doors 1 and 2.
    const CAR: Word = Word([0x05, 0x04, 0x03, 0x00, 0x03, 0x01]);
    /// Hall call down, high priority, lift 1, floor 4, any door.
    const HALL: Word = Word([0x04, 0x02, 0x01, 0x04, 0xFF, 0x01]);

    fn with(Word(mut bytes): Word, byte: usize, value: u8) -> Word {
        bytes[byte] = value;
        Word(bytes)
    }

    #[test]
    fn an_output_is_for_a_lamp_by_function_lift_floor_and_door() {
        for (word, byte, value, is_meant) in [
            (CAR, 5, 0x00, true),
            (CAR, 0, 0x06, false),
            (CAR, 1, 0x05, false),
            (CAR, 2, 0x02, true),
            (CAR, 2, 0x04, false),
            (CAR, 3, 0x01, false),
            (CAR, 3, 0xFF, true),
            (CAR, 4, 0x02, true),
            (CAR, 4, 0xF0, false),
            (CAR, 4, 0x0C, false),
            (CAR, 4, 0xFF, true),
            (HALL, 4, 0x08, true),
            (HALL, 0, 0x02, false),
            (HALL, 3, 0x05, false),
        ] {
            assert_eq!(word.is_meant_by(with(word, byte, value)), is_meant, "byte {byte}: {value:X}h");
        }
    }

    #[test]
    fn a_position_indication_is_for_exactly_its_lifts() {
        let position = Word([0x40, 0x07, 0x03, 0xFF, 0xFF, 0x01]);
        assert!(position.is_meant_by(position));
        assert!(!position.is_meant_by(with(position, 2, 0x01)));
    }

    #[test]
    fn a_command_asks_for_kinds_of_inputs() {
        let door_open = Word([0x0E, 0x09, 0x01, 0x00, 0x01, 0x00]);
        let asked = |kind, lifts, floor| {
            let command = Word([0x00, kind, lifts, floor, 0xFF, 0x01]);
            [CAR, HALL, door_open].map(|input| input.is_asked_by(command))
        };
        assert_eq!(asked(0x00, 0xFF, 0xFF), [true, true, true]);
        assert_eq!(asked(0x01, 0xFF, 0xFF), [false, true, false]);
        assert_eq!(asked(0x02, 0xFF, 0xFF), [false, false, true]);
        assert_eq!(asked(0x03, 0xFF, 0xFF), [false, false, true]);
        assert_eq!(asked(0x04, 0xFF, 0xFF), [false; 3], "acknowledgements are none of an input");
        assert_eq!(asked(0xFF, 0xFF, 0xFF), [false; 3]);
        assert_eq!(asked(0x00, 0x02, 0xFF), [true, false, false]);
        assert_eq!(asked(0x00, 0xFF, 0x04), [false, true, false]);
        assert!(!CAR.is_asked_by(Word([0; 6])), "no lift");
    }

    #[test]
    fn the_function_data_says_how_a_lamp_is_lit() {
        for (data, light) in [
            (0x00, Light::OFF),
            (0x01, Light::ON),
            (0x03, Light::ON),
            (0x06, Light::OFF),
            (0x37, Light(0x13)),
            (0x05, Light::ON),
            (0xF7, Light(0x17)),
        ] {
            assert_eq!(with(CAR, 5, data).light(), light, "{data:X}h");
        }
    }

    #[test]
    fn a_flashing_lamp_is_lit_for_half_its_period() {
        let light = Light::flashing(3);
        assert_eq!([0, 249, 250, 499, 500].map(|at| light.is_lit(at)), [true, true, false, false, true]);
        assert!(Light(0xFF).is_lit(77));
    }

    #[test]
    fn an_input_word_has_its_state() {
        assert_eq!(Word([1, 2, 3, 4, 5, 0x33]).with_state(false), Word([1, 2, 3, 4, 5, 0x30]));
        assert_eq!(Word([1, 2, 3, 4, 5, 0x30]).with_state(true), Word([1, 2, 3, 4, 5, 0x31]));
    }
}
