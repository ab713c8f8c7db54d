//! A board at which one thing goes wrong.

use std::ops::Range;

use anyhow::{Context, Result, bail};
use canbus::Time;
use chip::{Board, Stm32f4, Variant};
use emulator::{Machine, Model, Moment, Point, Stop};

use crate::program::{BAD, GOOD, PLACE};
use crate::scene::{Begin, Scene};

const FLASH: u32 = 512 * 1024;
/// Where code runs that was copied from flash.
const RAM: u32 = 0x2000_0000;
/// The region RETAINED (memory.x).
const RETAINED: Range<u32> = 0x2001_FF00..0x2002_0000;
const PC: u8 = 15;

/// How long a board is given at once.
const SLICE: Time = Time::from_millis(2);
/// A bootloader that has been asleep for so long has decided to stay.
const SETTLED: Time = Time::from_millis(20);
/// Longer than erasing and copying, or three resets by the watchdog, take.
const LIMIT: Time = Time::from_millis(8000);

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// This instruction does not run: its address and its bytes.
    Skip(u32, u32),
    /// Bit of a register, R0 to R14.
    Flip(u8, u8),
}

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

pub(crate) struct Rig {
    machine: Machine<Stm32f4>,
    bootloader: Vec<u8>,
    /// What a reset leaves alone, at the end of a decision without a fault.
    pub(crate) undisturbed: Vec<u8>,
}

impl Rig {
    /// With the ELF file of the bootloader.
    pub(crate) fn new(bootloader: &[u8]) -> Result<Rig> {
        let chip = Stm32f4::new(Variant::F446, Board::default());
        let machine = Machine::new(Model::stm32f4(FLASH), chip)?;
        Ok(Rig { machine, bootloader: bootloader.to_vec(), undisturbed: Vec::new() })
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
        let Outcome::Good = self.outcome(true)? else { bail!("the good application does not run") };
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
        let outcome = self.outcome(scene.has_good)?;
        self.undisturbed = self.retained();
        Ok((visits, outcome))
    }

    /// What a reset leaves alone.
    fn retained(&self) -> Vec<u8> {
        let mut bytes = vec![0; RETAINED.len()];
        let _ = self.machine.read(RETAINED.start, &mut bytes);
        bytes
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
        self.machine
            .next_instructions()
            .into_iter()
            .map(|(address, size)| Fault::Skip(address, size))
            .collect()
    }

    /// Does it, and runs to the end. What has settled gets another start where the fault has changed what the next start goes by: it
    /// must not leave a proof behind.
    pub(crate) fn disturb(&mut self, fault: Fault, has_good: bool) -> Result<Outcome> {
        match fault {
            Fault::Skip(address, size) => self.machine.skip((address, size))?,
            Fault::Flip(register, bit) => self.machine.flip(register, bit),
        }
        let outcome = self.outcome(has_good)?;
        if outcome != Outcome::Stays || self.retained() == self.undisturbed {
            return Ok(outcome);
        }
        self.machine.set_register(PC, 0x3000_0000);
        Ok(match self.outcome(has_good)? {
            Outcome::Broken => Outcome::Broken,
            _ => outcome,
        })
    }

    fn outcome(&mut self, has_good: bool) -> Result<Outcome> {
        let (begin, mut slept) = (self.machine.now(), self.machine.stats().asleep);
        while self.machine.now() < begin + LIMIT {
            match self.word() {
                BAD => return Ok(Outcome::Broken),
                GOOD => return Ok(Outcome::Good),
                _ => (),
            }
            if has_settled(&self.machine, has_good, &mut slept) {
                return Ok(Outcome::Stays);
            }
            self.machine.run_until(self.machine.now() + SLICE);
        }
        Ok(Outcome::Nothing)
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
