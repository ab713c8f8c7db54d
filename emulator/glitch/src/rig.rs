//! A board at which one thing goes wrong.

use std::collections::HashMap;

use anyhow::{Context, Result, bail};
use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Machine, Model, Moment, Point, Stop};

use crate::fault::Fault;
use crate::program::{BAD, GOOD, PLACE};
use crate::restart::{self, Restart};
use crate::scene::{Begin, Scene};

const FLASH: u32 = 512 * 1024;
/// Where code runs that was copied from flash.
const RAM: u32 = 0x2000_0000;
const PC: u8 = 15;

/// How long a board is given at once.
const SLICE: Time = Time::from_millis(2);
/// A bootloader that has been asleep for so long has decided to stay.
const SETTLED: Time = Time::from_millis(20);
/// Longer than erasing and copying, or three resets by the watchdog, take.
const LIMIT: Time = Time::from_millis(8000);

/// What comes of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// What may not run has run.
    Broken,
    /// The application that may run does.
    Good,
    /// The bootloader stays.
    Stays,
    /// Neither within eight seconds: it is reset again and again.
    Nothing,
}

/// A core without a clock is in its next instruction for seconds: the watchdog and the start after it are still waited for.
const LEAST_SLICES: usize = 1000;

/// Which of the outcomes that are known.
const WITHOUT: usize = 0;
const WITH_ANOTHER_START: usize = 1;

/// A run to its end.
struct Run {
    outcome: Outcome,
    /// The outcome is that of an earlier run, which went on from the same reset.
    is_known: bool,
    /// The resets on the way.
    restarts: Vec<Restart>,
}

pub(crate) struct Rig {
    machine: Machine<Stm32f4>,
    bootloader: Vec<u8>,
    /// What a reset leaves alone, at the end of a decision without a fault.
    pub(crate) undisturbed: Vec<u8>,
    /// What has come of the resets so far, before another start that only shows whether a proof was left behind, and after.
    known: [HashMap<Restart, Outcome>; 2],
}

impl Rig {
    /// With the ELF file of the bootloader.
    pub(crate) fn new(bootloader: &[u8]) -> Result<Rig> {
        let chip = Stm32f4::new(Variant::F446, Board::default());
        let mut machine = Machine::new(Model::stm32f4(FLASH), chip)?;
        machine.stop_at_resets(true);
        let bootloader = bootloader.to_vec();
        Ok(Rig { machine, bootloader, undisturbed: Vec::new(), known: [HashMap::new(), HashMap::new()] })
    }

    /// Brings the board to the start at which it decides, and watches from there for these points.
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

    /// Lets the good application run, puts the other in its place, and waits for the watchdog.
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

    /// Runs on to the next point; `None` at the end of the decision.
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

    /// The instructions from the decision's start to its end that were run from RAM, with the number of their visits.
    pub(crate) fn survey(&mut self, scene: &Scene) -> Result<(Vec<Point>, Outcome)> {
        self.start(scene, Vec::new())?;
        self.next(scene.has_good)?;
        let visits = self.machine.visits().into_iter().filter(|point| point.address >= RAM).collect();
        let outcome = self.outcome(scene.has_good);
        self.undisturbed = restart::retained(&self.machine);
        Ok((visits, outcome))
    }

    /// A moment to go back to, out of the watch.
    pub(crate) fn stop(&mut self) -> Result<Moment<Stm32f4>> {
        self.machine.unwatch()?;
        Ok(self.machine.moment()?)
    }

    pub(crate) fn go_back(&mut self, moment: &Moment<Stm32f4>) -> Result<()> {
        Ok(self.machine.go_back(moment)?)
    }

    /// The skips that are possible here.
    pub(crate) fn skips(&self) -> Vec<Fault> {
        self.machine.next_instructions().into_iter().map(|(at, size)| Fault::Skip { at, size }).collect()
    }

    /// Of the instruction at this address, and of its block where it is an IT instruction.
    pub(crate) fn code(&self, address: u32) -> Vec<u8> {
        let sizes = self.machine.instructions_at(address).into_iter().map(|(_, size)| size as usize);
        let mut code = vec![0; sizes.sum()];
        let _ = self.machine.read(address, &mut code);
        code
    }

    /// Does it, and runs to the end.
    pub(crate) fn disturb(&mut self, fault: Fault, has_good: bool) -> Result<Outcome> {
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
        Ok(self.final_outcome(has_good))
    }

    /// What has settled gets another start where the fault has changed what the next start goes by: it must not leave a proof behind.
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

    /// What comes of it.
    fn outcome(&mut self, has_good: bool) -> Outcome {
        let run = self.run(has_good, WITHOUT);
        self.learn(WITHOUT, run.restarts, run.outcome);
        run.outcome
    }

    /// These resets have led to this outcome. What did not come in time may come after a later reset in time.
    fn learn(&mut self, which: usize, restarts: Vec<Restart>, outcome: Outcome) {
        if outcome != Outcome::Nothing {
            self.known[which].extend(restarts.into_iter().map(|restart| (restart, outcome)));
        }
    }

    /// Runs to the end, or to a reset after which the outcome is known.
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

    /// The outcome, where the board has come to one.
    fn seen(&self, has_good: bool, slept: &mut Time) -> Option<Outcome> {
        match self.word() {
            BAD => Some(Outcome::Broken),
            GOOD => Some(Outcome::Good),
            _ => has_settled(&self.machine, has_good, slept).then_some(Outcome::Stays),
        }
    }

    /// What an application has left.
    fn word(&self) -> u32 {
        let mut bytes = [0; 4];
        let _ = self.machine.read(PLACE, &mut bytes);
        Some(u32::from_le_bytes(bytes)).filter(|word| [GOOD, BAD].contains(word)).unwrap_or(0)
    }
}

/// Whether the bootloader stays for good. Where another application is to run it sleeps while sectors are erased, and stays only
/// when it has slept for much longer.
fn has_settled(machine: &Machine<Stm32f4>, has_good: bool, slept: &mut Time) -> bool {
    let long = if has_good { SETTLED * 250 } else { SETTLED };
    machine.stats().asleep.since(*slept) > long
}
