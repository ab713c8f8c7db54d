//! A program on the emulated core: runs one request at a time and counts its instructions.

use std::path::Path;

use anyhow::{Context, Result, bail, ensure};
use canbus::Time;
use canopen::Frame;
use emulator::{Machine, Model, Stop, Visits};

use crate::bench::mailbox::{Mailbox, Request};

/// Time limit of a request: no operation takes this long.
const LIMIT: Time = Time::from_millis(1000);

/// A program that waits for its next request.
pub(crate) struct Program {
    machine: Machine<Mailbox>,
    /// Instructions of the empty loop.
    empty: u64,
}

/// The result of a request: the instructions and the frames.
#[derive(Debug)]
pub(crate) struct Outcome {
    /// Instructions without those of the empty loop.
    pub(crate) instructions: u64,
    pub(crate) frames: Vec<Frame>,
}

impl Program {
    /// Loads an ELF file and measures its empty loop.
    pub(crate) fn start(path: &Path) -> Result<Program> {
        let file = std::fs::read(path).with_context(|| path.display().to_string())?;
        let mut machine = Machine::new(Model::stm32f4(512 * 1024), Mailbox::default())?;
        machine.load_elf(&file)?;
        machine.power_on(Time::ZERO);
        let mut program = Program { machine, empty: 0 };
        // The start-up code runs before the first request; only the second run is the empty loop alone.
        program.run(Request::default())?;
        program.empty = program.run(Request::default())?.instructions;
        Ok(program)
    }

    /// Carries out a request. The program may send frames meanwhile.
    pub(crate) fn run(&mut self, request: Request) -> Result<Outcome> {
        let mailbox = self.machine.peripherals_mut();
        (mailbox.request, mailbox.is_done) = (request, false);
        // The instructions of the empty loop are subtracted at the end: between two frames a node may execute fewer
        // instructions than the empty loop.
        let (mut instructions, mut empty) = (0_u64, 0);
        let end = self.machine.now() + LIMIT;
        while !self.is_done()? {
            self.machine.set_profiling(self.machine.peripherals().counts);
            let (counted, before) = (self.machine.peripherals().counts, self.machine.stats().instructions);
            ensure!(self.machine.run_until(end) == Stop::Poked, "the program does not come to an end");
            let passed = self.machine.stats().instructions - before;
            match (counted, self.machine.peripherals().counts) {
                (true, true) => instructions += passed,
                (true, false) => {
                    instructions += passed;
                    empty += self.empty;
                }
                _ => (),
            }
        }
        let instructions = instructions.saturating_sub(empty);
        Ok(Outcome { instructions, frames: std::mem::take(&mut self.machine.peripherals_mut().sent) })
    }

    /// Visits of each block of counted instructions since the last call.
    pub(crate) fn take_profile(&mut self) -> Vec<Visits> {
        self.machine.take_profile()
    }

    fn is_done(&self) -> Result<bool> {
        let mailbox = self.machine.peripherals();
        if mailbox.has_panicked {
            bail!("the program has panicked");
        }
        Ok(mailbox.is_done)
    }
}
