//! The panel in the image: words of buttons and lamps, the virtual input and output.

use super::values::{differ, pair};
use crate::lift::panel::{BUTTONS, Calls, LAMPS};
use crate::lift::word::{Light, Word};
use canopen::dictionary::{Dictionary, Field};

/// Where the values of the panel are.
#[derive(Debug)]
pub(super) struct PanelFields {
    input: Field,
    output: Field,
    /// The words of a button while it is released and while it is pressed.
    buttons: [[Field; 2]; BUTTONS],
    /// 6120h: bit 0, the input is used.
    enabled: [Field; BUTTONS],
    /// The words that put a lamp out and that light it.
    lamp_words: [[Field; 2]; LAMPS],
    /// 6200h: the words that lamps answer to.
    answers: [Field; LAMPS],
    lamps: [Field; LAMPS],
}

/// The lamps beyond what the image says of them.
#[derive(Debug, Default)]
pub(super) struct LampStates {
    milliseconds: u32,
    /// The lifts that have lit a lamp: one of them does not put out what another one has lit.
    lit_by: [u8; LAMPS],
    /// What is left of a pulse, in ms; 0 before its first.
    pulse: [u16; LAMPS],
}

impl PanelFields {
    pub(super) const fn new(d: &Dictionary) -> PanelFields {
        PanelFields {
            input: d.field(0x6010, 0),
            output: d.field(0x6011, 0),
            buttons: [pair(d, 0x2320, 1), pair(d, 0x2320, 3)],
            enabled: pair(d, 0x6120, 1),
            lamp_words: [pair(d, 0x2321, 1), pair(d, 0x2321, 3)],
            answers: pair(d, 0x6200, 1),
            lamps: pair(d, 0x2322, 1),
        }
    }

    /// Puts the next call into the virtual input; whether there was one. A button that is not used has none.
    pub(super) fn next_call(&self, calls: &mut Calls, image: &mut [u8]) -> bool {
        while let Some(contact) = calls.next() {
            let button = usize::from(contact.button);
            let (Some(words), Some(enabled)) = (self.buttons.get(button), self.enabled.get(button)) else {
                continue;
            };
            if differ(*words, image) && enabled.u32(image) & 1 != 0 {
                let [released, pressed] = words;
                let word = if contact.is_pressed { pressed } else { released };
                self.input.store(image, word.load::<6>(image));
                return true;
            }
        }
        false
    }

    /// 6100h: an input with the public structure has the same word for both of its states, but for the state.
    pub(super) fn take_input(&self, button: usize, bytes: &[u8], image: &mut [u8]) {
        let (Some(words), Ok(word)) = (self.buttons.get(button), bytes.try_into()) else { return };
        for (at, is_set) in words.iter().zip([false, true]) {
            let Word(word) = Word(word).with_state(is_set);
            at.store(image, word);
        }
    }

    /// A command in the virtual output asks inputs for their states.
    pub(super) fn answer(&self, calls: &mut Calls, image: &[u8]) {
        let command = Word(self.output.load(image));
        for (button, [released, _]) in self.buttons.iter().enumerate() {
            if Word(released.load(image)).is_asked_by(command) {
                calls.ask(button);
            }
        }
    }

    /// Does what a virtual output says to the lamps. To be called for every frame that brings one, the same one too: somebody
    /// else may have changed the lamp since.
    pub(super) fn follow_output(&self, states: &mut LampStates, image: &mut [u8]) {
        let output = self.output.load(image);
        for ((words, answer), (lamp, lit_by)) in
            self.lamp_words.iter().zip(&self.answers).zip(self.lamps.iter().zip(&mut states.lit_by))
        {
            let [off, on]: [[u8; 6]; 2] = words.map(|at| at.load(image));
            match (output == on, output == off) {
                (true, false) => lamp.store(image, [Light::ON.0]),
                (false, true) => lamp.store(image, [Light::OFF.0]),
                _ => {}
            }
            let (own, output) = (Word(answer.load(image)), Word(output));
            if own != Word::default() && own.is_meant_by(output) {
                let light = follow(lit_by, own.lifts() & output.lifts(), output.light());
                lamp.store(image, [light.unwrap_or(Light(lamp.u8(image))).0]);
            }
        }
    }

    /// A client has set a lamp: whoever has lit it before has no part in it any more.
    pub(super) fn forget_lamp(&self, lamp: usize, states: &mut LampStates) {
        if let (Some(lit_by), Some(pulse)) = (states.lit_by.get_mut(lamp), states.pulse.get_mut(lamp)) {
            (*lit_by, *pulse) = (0, 0);
        }
    }

    /// A millisecond passes: pulses end.
    pub(super) fn pass(&self, states: &mut LampStates, image: &mut [u8]) {
        states.milliseconds = states.milliseconds.wrapping_add(1);
        for (lamp, left) in self.lamps.iter().zip(&mut states.pulse) {
            let Some(duration) = Light(lamp.u8(image)).duration() else {
                *left = 0;
                continue;
            };
            *left = if *left == 0 { duration } else { *left - 1 };
            if *left == 0 {
                lamp.store(image, [Light::OFF.0]);
            }
        }
    }

    /// Which lamps are lit.
    pub(super) fn lit(&self, states: &LampStates, image: &[u8]) -> [bool; LAMPS] {
        self.lamps.map(|lamp| Light(lamp.u8(image)).is_lit(states.milliseconds))
    }
}

/// What becomes of a lamp when these lifts light it or put it out; `None` when others still light it.
fn follow(lit_by: &mut u8, lifts: u8, light: Light) -> Option<Light> {
    if light == Light::OFF {
        *lit_by &= !lifts;
        return (*lit_by == 0).then_some(light);
    }
    *lit_by |= lifts;
    Some(light)
}
