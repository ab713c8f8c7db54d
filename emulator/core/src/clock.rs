//! The clock of virtual time. Before a block of code runs, its cycles are added to the time; if an event is due, the
//! block is stopped instead.
//!
//! This is the most frequent operation of the emulator. The CPU library therefore calls the hook directly, without the
//! reference counting that the Rust binding does in every call.

use std::ffi::c_void;

use chip::Peripherals;
use unicorn_engine::hook::sys::{uc_emu_stop, uc_hook_add, uc_reg_read, uc_reg_write};
use unicorn_engine::hook::uc_engine;
use unicorn_engine::{HookType, RegisterARM, Unicorn, uc_error};

use crate::core::{Core, Halt};
use crate::cost::{BASEPRI, Cost, EXCLUSIVE, FLOATS};
use crate::engine::{Cpu, HIDDEN, RAM};
use crate::mechanism::Mechanism;
use crate::nvic::Masks;
use crate::scb::cfsr;

/// A handle of the CPU library with the operations that a hook may use.
#[derive(Clone, Copy)]
pub(crate) struct Library(*mut uc_engine);

impl Library {
    pub(crate) fn of<P>(cpu: &Unicorn<Core<P>>) -> Library {
        Library(cpu.get_handle())
    }

    /// Stops the CPU before the current code.
    pub(crate) fn stop(self) {
        // SAFETY: the handle belongs to the CPU whose hook is running.
        unsafe { uc_emu_stop(self.0) };
    }

    /// The value of a register; 0 if the library refuses to read it.
    fn register(self, register: RegisterARM) -> u64 {
        let mut value = 0_u64;
        // SAFETY: as in `stop`; no register of the core is larger than the value.
        unsafe { uc_reg_read(self.0, register as i32, (&raw mut value).cast()) };
        value
    }

    fn set_register(self, register: RegisterARM, value: u64) {
        // SAFETY: as in `register`.
        unsafe { uc_reg_write(self.0, register as i32, (&raw const value).cast()) };
    }
}

/// The implemented bits of a priority.
const PRIORITY: u64 = 0xF0;

/// Clears the bits of BASEPRI that the chip does not implement; the library keeps all eight bits.
#[cold]
fn trim_basepri<P: Peripherals>(library: Library, core: &mut Core<P>) {
    library.set_register(RegisterARM::BASEPRI, library.register(RegisterARM::BASEPRI) & PRIORITY);
    core.wrote_basepri = false;
}

/// Installs the hook that counts the cycles of every block.
pub(crate) fn charge_blocks<P: Peripherals + 'static>(cpu: &mut Cpu<P>) -> Result<(), uc_error> {
    let core: *mut Core<P> = cpu.get_data_mut();
    let mut hook = 0;
    let (first, last) = (1_u64, 0_u64);
    // SAFETY: the core lives in the CPU, at an address that does not change, as long as the hook does; the signature is
    // that of a hook for blocks. A first address above the last one means all addresses.
    unsafe {
        let on_block: unsafe extern "C" fn(*mut uc_engine, u64, u32, *mut Core<P>) = on_block::<P>;
        uc_hook_add(
            cpu.get_handle(),
            &raw mut hook,
            HookType::BLOCK.0 as i32,
            on_block as *mut c_void,
            core.cast(),
            first,
            last,
        )
    }
    .and(Ok(()))
}

/// # Safety
/// Only the library calls this function, as `charge_blocks` has requested, and no other Rust code uses the core during
/// the call.
unsafe extern "C" fn on_block<P: Peripherals>(
    uc: *mut uc_engine,
    address: u64,
    size: u32,
    core: *mut Core<P>,
) {
    // SAFETY: see above.
    let core = unsafe { &mut *core };
    if address & !0xFFF == HIDDEN {
        guard_hidden(Library(uc), core);
    } else if core.stepping.is_none() {
        pass(Library(uc), core, address as u32, size);
    }
}

/// Faults when the program jumps into the emulator's own page, which the chip does not have.
fn guard_hidden<P: Peripherals>(library: Library, core: &mut Core<P>) {
    if !core.clearing_monitor {
        core.stop_for(Halt::Undefined);
        library.stop();
    }
}

/// Counts the cycles of code that is about to run, or stops before the code when an event is due.
#[inline]
pub(crate) fn pass<P: Peripherals>(library: Library, core: &mut Core<P>, address: u32, size: u32) -> bool {
    if core.wrote_basepri {
        trim_basepri(library, core);
    }
    if !core.is_undisturbed() && is_stopped(library, core, address) {
        core.stop_for(core.halt.unwrap_or(Halt::Attention));
        library.stop();
        return false;
    }
    let cost = match core.costs.get(address, size) {
        Some(cost) => *cost,
        None => learn(core, address, size),
    };
    if cost.uses != 0 && !allows(core, cost.uses) {
        return refuse(library, core, cfsr::NOCP);
    }
    core.place = address;
    core.profile.visit(address, size);
    let fetch = core.fetch_cycles(address, size);
    core.spend(cost.instructions.into(), fetch + u32::from(cost.cycles));
    true
}

/// Whether the program may run a block with these uses. Records uses that later steps need to know of.
fn allows<P>(core: &mut Core<P>, uses: u16) -> bool {
    core.exclusive |= uses & EXCLUSIVE != 0;
    core.wrote_basepri |= uses & BASEPRI != 0;
    if uses & FLOATS != 0 {
        core.scb.end_lazy();
    }
    uses & FLOATS == 0 || core.scb.allows_floats()
}

/// Whether the block must not run: the exact but slow check.
#[cold]
fn is_stopped<P: Peripherals>(library: Library, core: &Core<P>, address: u32) -> bool {
    let waits = core.flash_closed && address < RAM;
    let preempts = || core.nvic.could_preempt() && core.to_take(masks_of(library, core)).is_some();
    waits || core.halt.is_some() || core.needs_attention() || preempts()
}

/// Stops before code that causes a usage fault.
pub(crate) fn refuse<P: Peripherals>(library: Library, core: &mut Core<P>, status: u32) -> bool {
    core.stop_for(Halt::Usage(status));
    library.stop();
    false
}

#[cold]
fn learn<P>(core: &mut Core<P>, address: u32, size: u32) -> Cost {
    let mut code = vec![0; size as usize];
    // The block is about to run, so its code is readable.
    let _ = core.memory.read(address, &mut code);
    core.costs.learn(address, &code)
}

/// The masking registers, without those that a test has switched off.
pub(crate) fn masks<P: Peripherals>(cpu: &Unicorn<Core<P>>) -> Masks {
    masks_of(Library::of(cpu), cpu.get_data())
}

fn masks_of<P: Peripherals>(library: Library, core: &Core<P>) -> Masks {
    let without_basepri = core.lacks(Mechanism::Basepri);
    Masks {
        primask: library.register(RegisterARM::PRIMASK) & 1 != 0,
        faultmask: library.register(RegisterARM::FAULTMASK) & 1 != 0,
        basepri: if without_basepri { 0 } else { library.register(RegisterARM::BASEPRI) as u8 & 0xF0 },
    }
}
