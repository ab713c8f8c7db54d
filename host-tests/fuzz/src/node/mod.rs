//! The complete node: frames, time, readings, resets and power cuts in any order, with a check of the rules after every
//! step.

mod board;
mod flash;
mod rules;
mod step;
mod watch;

use arbitrary::Unstructured;
use node::Personality;

use board::Board;
use rules::Seen;
use step::Step;

/// Decodes a personality and then steps.
pub fn run(data: &[u8]) {
    let mut input = Unstructured::new(data);
    let Ok(personality) = input.choose(&Personality::ALL) else { return };
    let mut board = Board::new(*personality);
    while !input.is_empty() {
        let Ok(step) = input.arbitrary::<Step>() else { return };
        let before = Seen::of(&board);
        board.take(&step);
        rules::check(&step, before, &mut board);
    }
}
