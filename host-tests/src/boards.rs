//! The monitor on the bus of emulated boards.

use canbus::{Frame, Time};
use canopen::Instant;
use emulator::Incident as Reset;
use monitor::{Incident, Sender};
use node::Personality;
use sim::world::{Observer, World};

use crate::network::from_bus;
use crate::watch::{Watch, sheet};

/// Lets a monitor listen to the boards of a world from their start.
///
/// # Panics
/// When a board has a personality that the node does not have.
pub fn watch(world: &mut World) {
    let mut watch = Watch::of_bus(world.bit_rate());
    for (number, board) in world.boards().iter().enumerate() {
        let personality = Personality::numbered(board.personality().number()).expect("a personality");
        watch.monitor().set_sheet(number, sheet(personality), true);
        watch.incident(Instant(0), number, Incident::PowerOn);
    }
    world.observe(Some(Box::new(Listener(watch))));
}

/// Passes everything to the monitor.
struct Listener(Watch);

impl Observer for Listener {
    fn bit_rate(&mut self, bits_per_second: u32) {
        self.0.monitor().set_bit_rate(bits_per_second);
    }

    fn frame(&mut self, at: Time, frame: &Frame, board: Option<usize>) {
        if let Some(frame) = from_bus(frame) {
            self.0.frame(instant(at), &frame, board.map_or(Sender::Other, Sender::Node));
        }
    }

    fn failed(&mut self, start: Time, frame: &Frame, board: Option<usize>) {
        if let Some(frame) = from_bus(frame) {
            let sender = board.map_or(Sender::Other, Sender::Node);
            self.0.monitor().failed(instant(start), &frame, sender);
        }
    }

    fn incident(&mut self, at: Time, board: usize, incident: &Reset) {
        let incident = match incident {
            Reset::SoftwareReset => Incident::SoftwareReset,
            Reset::ChipReset => Incident::ChipReset,
            // A fault leads to a reset; a broken rule of the chip ends the test by itself.
            Reset::Fault(_) | Reset::Breach { .. } => return,
        };
        self.0.incident(instant(at), board, incident);
    }

    fn power(&mut self, at: Time, board: usize, is_on: bool) {
        let incident = if is_on { Incident::PowerOn } else { Incident::PowerOff };
        self.0.incident(instant(at), board, incident);
    }

    fn touched(&mut self, at: Time, board: usize) {
        self.0.incident(instant(at), board, Incident::Touched);
    }

    fn time(&mut self, at: Time) {
        self.0.feed(|monitor| monitor.advance(instant(at)));
    }
}

fn instant(at: Time) -> Instant {
    Instant(at.as_micros())
}
