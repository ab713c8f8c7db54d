//! The panel in the image: words of buttons and lamps, virtual input, virtual output.

use super::values::pair;
use crate::lift::panel::{BUTTONS, Calls, LAMPS};
use crate::lift::word::{Light, Word};
use canopen::dictionary::{Dictionary, Field};

/// The places of the panel's values.
#[derive(Debug)]
pub(super) struct PanelFields {
    input: Field,
    output: Field,
    /// 6100h: the words with the public structure.
    inputs: [Field; BUTTONS],
    /// The words of a button while it is released and while it is pressed.
    buttons: [[Field; 2]; BUTTONS],
    /// 6120h: bit 0, the input is used.
    enabled: [Field; BUTTONS],
    /// The words that switch a lamp off and on.
    lamp_words: [[Field; 2]; LAMPS],
    /// 6200h: the words with the public structure to which lamps respond.
    answers: [Field; LAMPS],
    lamps: [Field; LAMPS],
}

/// State of the lamps beyond the image.
#[derive(Debug, Default)]
pub(super) struct LampStates {
    pub(super) milliseconds: u32,
    /// The lifts and doors that have lit a lamp: a lift or a door does not switch off a lamp that another one has lit.
    lit_by: [u32; LAMPS],
}

impl PanelFields {
    pub(super) const fn new(d: &Dictionary) -> PanelFields {
        PanelFields {
            input: d.field(0x6010, 0),
            output: d.field(0x6011, 0),
            inputs: pair(d, 0x6100, 1),
            buttons: [pair(d, 0x2320, 1), pair(d, 0x2320, 3)],
            enabled: pair(d, 0x6120, 1),
            lamp_words: [pair(d, 0x2321, 1), pair(d, 0x2321, 3)],
            answers: pair(d, 0x6200, 1),
            lamps: pair(d, 0x2322, 1),
        }
    }

    /// Writes the next call to the virtual input and returns whether there was one. An unused button has no calls.
    #[inline(never)]
    pub(super) fn next_call(&self, calls: &mut Calls, image: &mut [u8]) -> bool {
        while let Some(contact) = calls.take_next() {
            let place = usize::from(contact.button);
            let (Some(words), Some(enabled)) = (self.buttons.get(place), self.enabled.get(place)) else {
                return false;
            };
            let [released, pressed] = [words[0], words[1]].map(|at| word(at, image));
            let is_used = enabled.u32(image) & 1 != 0;
            if released != pressed && calls.tell(contact, is_used) {
                let Word(told) = if contact.is_pressed && is_used { pressed } else { released };
                self.input.set(image, &told);
                return true;
            }
        }
        false
    }

    /// 6100h: for an input with the public structure, the words of its two states differ in the state alone. A value of 0
    /// takes these words away, and leaves other words of 2320h alone.
    #[inline(never)]
    pub(super) fn take_input(&self, button: usize, bytes: &[u8], image: &mut [u8]) {
        let (Some([released, pressed]), Ok(new)) = (self.buttons.get(button), bytes.try_into()) else {
            return;
        };
        let new = Word(new);
        if new == Word::default() && !self.follows_input(button, image) {
            return;
        }
        released.set(image, &new.with_state(false).0);
        pressed.set(image, &new.with_state(new != Word::default()).0);
    }

    /// Whether the words of a button are those of its input in 6100h.
    #[inline(never)]
    fn follows_input(&self, button: usize, image: &[u8]) -> bool {
        let (Some([released, pressed]), Some(input)) = (self.buttons.get(button), self.inputs.get(button))
        else {
            return false;
        };
        let input = word(*input, image);
        word(*released, image) == input.with_state(false) && word(*pressed, image) == input.with_state(true)
    }

    /// 2320h has been written. Words that are not those of 6100h replace that input.
    #[inline(never)]
    pub(super) fn replace_word(&self, button: usize, image: &mut [u8]) {
        if !self.follows_input(button, image)
            && let Some(input) = self.inputs.get(button)
        {
            input.set(image, &[0; 6]);
        }
    }

    /// Handles a command in the virtual output that asks inputs for their states.
    #[inline(never)]
    pub(super) fn answer(&self, calls: &mut Calls, image: &[u8]) {
        let command = word(self.output, image);
        for (button, [released, _]) in self.buttons.iter().enumerate() {
            if word(*released, image).is_asked_by(command) {
                calls.ask(button);
            }
        }
    }

    /// Applies a virtual output to the lamps. Must be called for every received frame, also for a repeated one, because
    /// another client may have changed the lamp in the meantime.
    #[inline(never)]
    pub(super) fn follow_output(&self, states: &mut LampStates, image: &mut [u8]) {
        let output = word(self.output, image);
        let lamps = self.lamp_words.iter().zip(&self.answers).zip(self.lamps.iter().zip(&mut states.lit_by));
        for (([off, on], answer), (lamp, lit_by)) in lamps {
            // A lamp that a client has put out is lit by no lift.
            *lit_by = if lamp.u8(image) == 0 { 0 } else { *lit_by };
            if let Some(Light(light)) = says([*off, *on, *answer], output, lit_by, image) {
                lamp.set(image, &[light]);
            }
        }
    }

    /// Which lamps are lit now.
    #[inline(never)]
    pub(super) fn lit(&self, states: &LampStates, image: &[u8]) -> [bool; LAMPS] {
        self.lamps.map(|lamp| Light(lamp.u8(image)).is_lit(states.milliseconds))
    }
}

impl LampStates {
    /// A client has set a lamp, so the lifts that had lit it no longer count.
    pub(super) fn forget(&mut self, lamp: usize) {
        if let Some(lit_by) = self.lit_by.get_mut(lamp) {
            *lit_by = 0;
        }
    }
}

/// Effect of an output on the lamp with these words: the word that switches it off, the word that switches it on, and
/// its word with the public structure.
#[inline(never)]
fn says(words: [Field; 3], output: Word, lit_by: &mut u32, image: &[u8]) -> Option<Light> {
    let [off, on, own] = words.map(|at| word(at, image));
    if own != Word::default() && own.is_meant_by(output) {
        return follow(lit_by, own.places(output), output.light());
    }
    if off == on {
        return None;
    }
    let light = if output == on { Light::ON } else { Light::OFF };
    (output == on || output == off).then_some(light)
}

/// The new state of a lamp after these places light it or switch it off; `None` while other places still light it.
fn follow(lit_by: &mut u32, places: u32, light: Light) -> Option<Light> {
    if light == Light::OFF {
        *lit_by &= !places;
        return (*lit_by == 0).then_some(light);
    }
    *lit_by |= places;
    Some(light)
}

/// Not inlined: this crate is compiled for speed, and calls are not urgent.
#[inline(never)]
fn word(at: Field, image: &[u8]) -> Word {
    Word(at.load(image))
}
