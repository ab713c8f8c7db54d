//! A board with one injected fault.

use std::collections::HashMap;

use anyhow::{Context, Result, bail};
use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Machine, Model, Moment, Point, Stop};

use crate::glitch::fault::Fault;
use crate::glitch::program::{BAD, GOOD, PLACE};
use crate::glitch::restart::{self, Restart};
use crate::glitch::scene::{Begin, Scene};

const FLASH: u32 = 512 * 1024;
/// Start of RAM, where code that was copied from flash runs.
const RAM: u32 = 0x2000_0000;
const PC: u8 = 15;

/// Time slice of a board.
const SLICE: Time = Time::from_millis(2);
/// Time asleep after which the bootloader has decided to stay.
const SETTLED: Time = Time::from_millis(20);
/// Time limit of a run: longer than erase and copy, and than three resets by the watchdog.
const LIMIT: Time = Time::from_millis(8000);

/// Outcome of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The forbidden application has run.
    Broken,
    /// The permitted application runs.
    Good,
    /// The bootloader stays.
    Stays,
    /// Neither application runs within eight seconds, because the board is reset repeatedly.
    Nothing,
}

/// Least number of slices: a core without a clock needs seconds for its next instruction, and the run includes the watchdog reset and
/// the start after it.
const LEAST_SLICES: usize = 1000;

/// Indexes of the cached outcomes.
const WITHOUT: usize = 0;
const WITH_ANOTHER_START: usize = 1;

/// A run to its end.
struct Run {
    outcome: Outcome,
    /// Whether the outcome is that of an earlier run with the same reset state.
    is_known: bool,
    /// Resets during the run.
    restarts: Vec<Restart>,
}

pub(crate) struct Rig {
    machine: Machine<Stm32f4>,
    bootloader: Vec<u8>,
    /// RAM that a reset does not change, after a decision without a fault.
    pub(crate) undisturbed: Vec<u8>,
    /// Cached outcomes by reset state, without and with the extra start that checks for a forged proof.
    known: [HashMap<Restart, Outcome>; 2],
}

impl Rig {
    /// A board with this ELF file of the bootloader.
    pub(crate) fn new(bootloader: &[u8]) -> Result<Rig> {
        let chip = Stm32f4::new(Variant::F446, Board::default());
        let mut machine = Machine::new(Model::stm32f4(FLASH), chip)?;
        machine.stop_at_resets(true);
        let bootloader = bootloader.to_vec();
        Ok(Rig { machine, bootloader, undisturbed: Vec::new(), known: [HashMap::new(), HashMap::new()] })
    }

    /// Runs the board to the start of the decision, and stops at these points from there on.
    pub(crate) fn start(&mut self, scene: &Scene, stops: Vec<Point>) -> Result<()> {
        self.machine.unwatch()?;
        self.machine.power_off();
        let first = if scene.begin == Begin::Reset { &Scene::good()? } else { &scene.flash };
        self.machine.set_flash(first)?;
        self.machine.load_elf(&self.bootloader)?;
        let now = self.machine.now();
        self.machine.power_on(now);
        if scene.begin == Begin::Reset {
            self.exchange(&scene.flash)?;
        }
        Ok(self.machine.watch(stops)?)
    }

    /// Runs the permitted application, exchanges it for the other one, and waits for the watchdog.
    fn exchange(&mut self, flash: &[u8]) -> Result<()> {
        let Outcome::Good = self.outcome(true) else { bail!("the good application does not run") };
        self.machine.set_flash(flash)?;
        self.machine.load_elf(&self.bootloader)?;
        self.machine.write(PLACE, &[0; 4]).ok().context("RAM")?;
        let resets = self.machine.incidents().len();
        while self.machine.incidents().len() == resets {
            self.machine.run_until(self.machine.now() + SLICE);
        }
        Ok(())
    }

    /// Continues to the next point; `None` at the end of the decision.
    pub(crate) fn next(&mut self, has_good: bool) -> Result<Option<Point>> {
        self.machine.resume_watch()?;
        let (begin, mut slept) = (self.machine.now(), self.machine.stats().asleep);
        while self.machine.now() < begin + LIMIT {
            if self.machine.run_until(self.machine.now() + SLICE) == Stop::Watched {
                return Ok(self.machine.stopped());
            }
            if self.word() != 0 || has_settled(&self.machine, has_good, &mut slept) {
                break;
            }
        }
        Ok(None)
    }

    /// Instructions of the decision that ran from RAM, with the number of their visits.
    pub(crate) fn survey(&mut self, scene: &Scene) -> Result<(Vec<Point>, Outcome)> {
        self.start(scene, Vec::new())?;
        self.next(scene.has_good)?;
        let visits = self.machine.visits().into_iter().filter(|point| point.address >= RAM).collect();
        let outcome = self.outcome(scene.has_good);
        self.undisturbed = restart::retained(&self.machine);
        Ok((visits, outcome))
    }

    /// Saves the state of the board and ends the watch.
    pub(crate) fn stop(&mut self) -> Result<Moment<Stm32f4>> {
        self.machine.unwatch()?;
        Ok(self.machine.moment()?)
    }

    pub(crate) fn go_back(&mut self, moment: &Moment<Stm32f4>) -> Result<()> {
        Ok(self.machine.go_back(moment)?)
    }

    /// Skips that are possible at this point.
    pub(crate) fn skips(&self) -> Vec<Fault> {
        self.machine.next_instructions().into_iter().map(|(at, size)| Fault::Skip { at, size }).collect()
    }

    /// Code of the instruction at this address, for an IT instruction with its block.
    pub(crate) fn code(&self, address: u32) -> Vec<u8> {
        let sizes = self.machine.instructions_at(address).into_iter().map(|(_, size)| size as usize);
        let mut code = vec![0; sizes.sum()];
        let _ = self.machine.read(address, &mut code);
        code
    }

    /// Stops at these points from here on.
    pub(crate) fn watch(&mut self, stops: &[Point]) -> Result<()> {
        Ok(self.machine.watch(stops.iter().copied())?)
    }

    /// Injects the fault and runs to the outcome.
    pub(crate) fn disturb(&mut self, fault: Fault, has_good: bool) -> Result<Outcome> {
        self.inject(fault)?;
        Ok(self.final_outcome(has_good))
    }

    /// Injects the fault.
    pub(crate) fn inject(&mut self, fault: Fault) -> Result<()> {
        match fault {
            Fault::Skip { at, size } => self.machine.skip((at, size))?,
            Fault::Flag { at, flag } => {
                self.machine.go_into_block(at)?;
                self.machine.flip_flag(flag);
            }
            Fault::Flip { at, register, bit } => {
                self.machine.go_into_block(at)?;
                self.machine.flip(register, bit);
            }
        }
        Ok(())
    }

    /// Outcome with an extra start if the bootloader stays and the fault has changed retained RAM: a forged proof must not start an image.
    fn final_outcome(&mut self, has_good: bool) -> Outcome {
        let run = self.run(has_good, WITH_ANOTHER_START);
        let starts_again = run.outcome == Outcome::Stays
            && !run.is_known
            && restart::retained(&self.machine) != self.undisturbed;
        let mut outcome = run.outcome;
        if starts_again {
            self.machine.set_register(PC, 0x3000_0000);
            outcome = Some(self.outcome(has_good)).filter(|last| *last == Outcome::Broken).unwrap_or(outcome);
        }
        self.learn(WITH_ANOTHER_START, run.restarts, outcome);
        outcome
    }

    /// Runs to the outcome and caches it.
    fn outcome(&mut self, has_good: bool) -> Outcome {
        let run = self.run(has_good, WITHOUT);
        self.learn(WITHOUT, run.restarts, run.outcome);
        run.outcome
    }

    /// Caches the outcome for these resets. A time-out is not cached, because a later reset may have an outcome in time.
    fn learn(&mut self, which: usize, restarts: Vec<Restart>, outcome: Outcome) {
        if outcome != Outcome::Nothing {
            self.known[which].extend(restarts.into_iter().map(|restart| (restart, outcome)));
        }
    }

    /// Runs to the outcome, or to a reset state with a cached outcome.
    fn run(&mut self, has_good: bool, which: usize) -> Run {
        let mut restarts = Vec::new();
        let (begin, mut slept) = (self.machine.now(), self.machine.stats().asleep);
        let mut slices = 0..LEAST_SLICES;
        while slices.next().is_some() || self.machine.now() < begin + LIMIT {
            if let Some(outcome) = self.seen(has_good, &mut slept) {
                return Run { outcome, is_known: false, restarts };
            }
            if self.machine.run_until(self.machine.now() + SLICE) == Stop::Reset {
                let restart = Restart::of(&mut self.machine);
                if let Some(&outcome) = self.known[which].get(&restart) {
                    return Run { outcome, is_known: true, restarts };
                }
                restarts.push(restart);
            }
        }
        Run { outcome: Outcome::Nothing, is_known: false, restarts }
    }

    /// The outcome, if the board has reached one.
    fn seen(&self, has_good: bool, slept: &mut Time) -> Option<Outcome> {
        match self.word() {
            BAD => Some(Outcome::Broken),
            GOOD => Some(Outcome::Good),
            _ => has_settled(&self.machine, has_good, slept).then_some(Outcome::Stays),
        }
    }

    /// Word that an application has written.
    fn word(&self) -> u32 {
        let mut bytes = [0; 4];
        let _ = self.machine.read(PLACE, &mut bytes);
        Some(u32::from_le_bytes(bytes)).filter(|word| [GOOD, BAD].contains(word)).unwrap_or(0)
    }
}

/// Whether the bootloader stays. With another application to copy it sleeps while sectors are erased, so it stays only after a much
/// longer sleep.
fn has_settled(machine: &Machine<Stm32f4>, has_good: bool, slept: &mut Time) -> bool {
    let long = if has_good { SETTLED * 250 } else { SETTLED };
    machine.stats().asleep.since(*slept) > long
}
