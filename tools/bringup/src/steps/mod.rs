//! The fifteen steps. Each one needs what the steps before it have shown.

mod bus;
mod program;
mod resets;
mod sensors;
mod start;

use anyhow::Result;

use crate::bench::Bench;

/// A step.
#[derive(Debug)]
pub struct Step {
    /// Its number.
    pub number: usize,
    /// Its name on the command line.
    pub name: &'static str,
    /// The property that it shows.
    pub about: &'static str,
    /// The remedy when the step cannot continue.
    pub remedy: &'static str,
    /// Makes the checks.
    pub run: fn(&mut Bench<'_>) -> Result<()>,
}

const fn step(
    number: usize,
    name: &'static str,
    about: &'static str,
    remedy: &'static str,
    run: fn(&mut Bench<'_>) -> Result<()>,
) -> Step {
    Step { number, name, about, remedy, run }
}

const PROBE: &str = "Check the USB cable of the ST-LINK, JP5 and the supply; on a board of your own SWDIO, SWCLK, GND and NRST";
const BUS: &str = "Check the transceiver's supply and its pins, the termination (60 ohm), CAN_H and CAN_L, and the bit rate of the adapter";
const NODE: &str =
    "The node does not answer: read the log (cargo xtask flash prints it), then repeat the step bus";

/// All steps.
pub const ALL: [Step; 15] = [
    step(1, "supply", "The debug probe reaches the chip, and the supply is right", PROBE, start::supply),
    step(
        2,
        "identity",
        "The chip is the one of the images, calibrated and not protected",
        PROBE,
        start::identity,
    ),
    step(3, "flash", "The flash has what was written to it", PROBE, start::flash),
    step(4, "clock", "The chip runs from its oscillator, at the right frequency", BUS, start::clock),
    step(5, "log", "The log comes within a second of each reset", PROBE, start::log),
    step(6, "resets", "Each cause of a reset is told from the others", NODE, resets::causes),
    step(7, "watchdog", "A program that hangs is ended in time", NODE, resets::watchdog),
    step(8, "receive", "The receive pin rests high; held low, it resets nothing", NODE, bus::receive_pin),
    step(9, "loop-back", "The CAN controller works at all bit rates, without a bus", PROBE, bus::loop_back),
    step(10, "bus", "The bus works at all bit rates without an error", BUS, bus::all_rates),
    step(11, "bus-faults", "The node is back after a short circuit of the bus", BUS, bus::short_circuit),
    step(
        12,
        "analogue",
        "Pressure input, references and temperature are right and quiet",
        NODE,
        sensors::analogue,
    ),
    step(
        13,
        "encoder",
        "The encoder counts, and the words of an absolute one are clean",
        NODE,
        sensors::encoder,
    ),
    step(14, "saves", "Parameters are saved under load, and are there after a reset", NODE, program::saves),
    step(15, "update", "The program is replaced over the bus, and no event was lost", NODE, program::update),
];

/// The step with this name or number.
#[must_use]
pub fn named(name: &str) -> Option<&'static Step> {
    ALL.iter().find(|step| step.name == name || step.number.to_string() == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_found_by_its_name_and_its_number() {
        for (number, step) in (1..).zip(&ALL) {
            assert_eq!(step.number, number);
            assert_eq!(named(step.name).map(|found| found.number), Some(number));
            assert_eq!(named(&number.to_string()).map(|found| found.name), Some(step.name));
        }
        assert!(named("0").is_none() && named("16").is_none() && named("").is_none());
    }
}
