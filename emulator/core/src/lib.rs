//! An emulated Cortex-M4 with its NVIC that runs ELF files in virtual time.
//!
//! The CPU library executes instructions. This crate adds the rest of the architecture: exceptions, the interrupt
//! controller, the system control space, and time. Time advances block by block, by the cost that `cost` computes; a
//! sleeping core jumps to the next event. The same input gives the same run, bit for bit; [`Stats::trace`] shows
//! whether two runs are equal.
//!
//! | file | contents |
//! |---|---|
//! | `machine`, `model`, `incident` | the machine with its public interface, and its run loop |
//! | `engine`, `memory` | the CPU library: memory map, hooks, registers; flash and RAM |
//! | `core` | the state that hooks and run loop share |
//! | `context`, `fault`, `exception` | entry, return and tail-chaining; faults and their escalation |
//! | `nvic`, `systick`, `scb`, `mpu`, `ppb` | the registers of the core |
//! | `stepping`, `alignment`, `posted` | the mode in which interrupts come between any two instructions; faults found only there, stores on their way |
//! | `watch` | stopping before an instruction, skipping it, flipping a bit of a register, going back |
//! | `cost`, `floats`, `estimate`, `accelerator` | cycles: of a block, of the floating-point unit, their range, of the flash |
//! | `stats`, `profile` | the counters, and the counts of each block |
//! | `loader` | ELF files |
//!
//! # Simplifications
//!
//! * Interrupts are taken between blocks of code, not between instructions: up to a few dozen cycles late. After
//!   [`Machine::interleave`] they are taken between any two instructions.
//! * Floating-point registers are stacked at exception entry, never lazily, though FPCCR and FPCAR show it so; a higher interrupt that arrives within the
//!   twelve cycles of an entry nests instead of going first.
//! * A refused load from a peripheral is a precise bus fault with the right address, but with the program counter of
//!   the next block. A load from unmapped memory has the exact program counter. A refused store is an imprecise fault
//!   at the next block.
//! * Flash becomes busy at the end of the block that has stored to it. A load from busy flash in an IT block is
//!   repeated from the start of the block.
//! * The MPU works page by page of a kilobyte, with the rights of privileged code, in fault handlers too. A region that asks
//!   for more is reported.
//! * WFE is a hint that never sleeps; there is no bit-band alias of RAM and no alias of flash at address 0.
//! * Where CPACR does not allow the floating-point unit, the fault comes at the start of the block that uses it.
//! * Unaligned LDM, LDRD, VLDR, LDREX and the like, and the accesses and divisions that CCR traps, fault only after
//!   [`Machine::interleave`], and not in an IT block. Without that mode a program that sets the traps is reported
//!   ([`chip::Breach`]).
//! * A store reaches its peripheral at once, and some cycles later only after [`Machine::interleave`].
//! * Cycle counts have a range ([`Estimate`]): the pipeline and the contention for the buses are not modelled.

mod accelerator;
mod alignment;
mod clock;
mod context;
mod core;
mod cost;
mod engine;
mod estimate;
mod exception;
mod fault;
mod floats;
mod incident;
mod it_block;
mod loader;
mod machine;
mod mechanism;
mod memory;
mod model;
mod mpu;
mod nvic;
mod posted;
mod power_up;
mod ppb;
mod profile;
mod scb;
mod seed;
mod semihosting;
mod stats;
mod stepping;
mod systick;
mod watch;

pub use estimate::{Estimate, NoEstimate};
pub use exception::Exception;
pub use fault::Fault;
pub use incident::Incident;
pub use loader::{Image, Segment};
pub use machine::{Machine, Stop};
pub use mechanism::Mechanism;
pub use model::{Error, Model};
pub use profile::Visits;
pub use seed::{Access, Bug};
pub use stats::{Activity, Stats};
pub use watch::{Flag, Moment, Point};
