//! A bench with a bare machine: a core and programmable flash. Its programs report a verdict.

use std::path::PathBuf;

use canbus::Time;
use chip::{BusFault, Effect, IrqLines, Memory, Peripherals};
use emulator::{Machine, Model};
use object::{Object, ObjectSymbol};

const PASSED: u32 = 0x600D_600D;
const FAILED: u32 = 0xBAD0_BAD0;

/// Duration of programming.
const BUSY: Time = Time::from_micros(16);

/// The verdict of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// All checks passed.
    Passed,
    /// A check failed; the number is the program's own.
    Failed(u32),
    /// No verdict within a tenth of a virtual second.
    Silent,
}

/// The level of interrupt 28, on a slow bus.
const LEVEL: u32 = 0x4000_0000;
/// A register, and the clock without which it takes nothing.
const CLOCKED: u32 = 0x4002_0000;
const ENABLE: u32 = 0x4002_3830;

/// Flash that accepts any store as programming, an interrupt line, and a register with a clock.
#[derive(Default)]
pub(crate) struct Bare {
    effects: Vec<Effect>,
    level: u32,
    clock: u32,
    clocked: u32,
}

impl Peripherals for Bare {
    fn read(&mut self, address: u32, _: u8, _: Time) -> Result<u32, BusFault> {
        match address {
            LEVEL => Ok(self.level),
            ENABLE => Ok(self.clock),
            CLOCKED => Ok(self.clocked),
            _ => Err(BusFault),
        }
    }

    fn write(&mut self, address: u32, _: u8, value: u32, _: Time) -> Result<(), BusFault> {
        match address {
            LEVEL => self.level = value,
            ENABLE => self.clock = value,
            CLOCKED if self.clock & 1 != 0 => self.clocked = value,
            CLOCKED => {}
            _ => return Err(BusFault),
        }
        Ok(())
    }

    fn apb_divider(&self, address: u32) -> Option<u32> {
        (address == LEVEL).then_some(16)
    }

    fn settling(&self, address: u32) -> u32 {
        if address == ENABLE { 2 } else { 0 }
    }

    fn program(&mut self, address: u32, old: &[u8], new: &[u8], now: Time) -> Result<(), BusFault> {
        let bytes = old.iter().zip(new).map(|(old, new)| old & new).collect();
        self.effects.push(Effect::Store { address, bytes });
        self.effects.push(Effect::StallFlash(now + BUSY));
        Ok(())
    }

    fn deadline(&self) -> Time {
        Time::NEVER
    }

    fn advance(&mut self, _: Time, _: &dyn Memory) {}

    fn lines(&self) -> IrqLines {
        IrqLines { irqs: u128::from(self.level & 1) << 28, nmi: false }
    }

    fn effect(&mut self) -> Option<Effect> {
        self.effects.pop()
    }

    fn reset(&mut self, _: bool, _: Time) {}
}

/// A machine with a program.
pub(crate) struct Bench {
    /// The machine.
    pub(crate) machine: Machine<Bare>,
    verdict: u32,
}

impl Bench {
    /// Loads a program of `mechanics-images`.
    pub(crate) fn new(program: &str) -> Bench {
        let file = load(program);
        let mut machine = Machine::new(Model::stm32f4(512 * 1024), Bare::default()).unwrap();
        machine.load_elf(&file).unwrap();
        machine.power_on(Time::ZERO);
        Bench { machine, verdict: verdict_of(program) }
    }

    /// Runs for a tenth of a virtual second.
    pub(crate) fn run(&mut self) -> Verdict {
        self.run_in_slices(Time::from_millis(1))
    }

    /// Runs to the verdict, for two virtual seconds at most: for programs that count.
    #[allow(dead_code)]
    pub(crate) fn run_long(&mut self) -> Verdict {
        while self.machine.now() < Time::from_millis(2000) && self.verdict() == Verdict::Silent {
            let until = self.machine.now() + Time::from_millis(1);
            self.machine.run_until(until);
        }
        self.verdict()
    }

    /// The address and the size of a function of a program.
    #[allow(dead_code)]
    pub(crate) fn function(program: &str, name: &str) -> (u32, u32) {
        let (address, size) = symbol(program, name);
        (address & !1, size)
    }

    /// Runs for a tenth of a virtual second, in slices.
    pub(crate) fn run_in_slices(&mut self, slice: Time) -> Verdict {
        let end = Time::from_millis(100);
        while self.machine.now() < end {
            let until = (self.machine.now() + slice).min(end);
            self.machine.run_until(until);
        }
        self.verdict()
    }

    fn verdict(&self) -> Verdict {
        verdict([self.word(0), self.word(1)])
    }

    /// A number noted by the program.
    pub(crate) fn note(&self, index: u32) -> u32 {
        self.word(2 + index)
    }

    fn word(&self, index: u32) -> u32 {
        let mut bytes = [0; 4];
        self.machine.read(self.verdict + 4 * index, &mut bytes).unwrap();
        u32::from_le_bytes(bytes)
    }
}

/// The meaning of the first two words of the verdict.
pub(crate) fn verdict([said, code]: [u32; 2]) -> Verdict {
    match said {
        PASSED => Verdict::Passed,
        FAILED => Verdict::Failed(code),
        _ => Verdict::Silent,
    }
}

/// The address of the verdict of a program.
pub(crate) fn verdict_of(program: &str) -> u32 {
    symbol(program, "VERDICT").0
}

/// The address and the size of a symbol of a program.
fn symbol(program: &str, name: &str) -> (u32, u32) {
    let file = load(program);
    let elf = object::File::parse(file.as_slice()).unwrap();
    let symbol = elf.symbols().find(|symbol| symbol.name() == Ok(name)).expect(name);
    (u32::try_from(symbol.address()).unwrap(), u32::try_from(symbol.size()).unwrap())
}

fn load(program: &str) -> Vec<u8> {
    let path = path(program);
    std::fs::read(&path).unwrap_or_else(|error| {
        panic!("{}: {error}; run `cargo xtask images --development` first", path.display())
    })
}

/// The ELF file of a program.
pub(crate) fn path(program: &str) -> PathBuf {
    directory().join(program)
}

/// The directory of the ELF files.
fn directory() -> PathBuf {
    std::env::var_os("MECHANICS_IMAGES").map_or_else(
        || PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../target/thumbv7em-none-eabihf/release")),
        PathBuf::from,
    )
}
