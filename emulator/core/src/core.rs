//! The CPU: the library with the chip's memory map, and the runs that it makes.

use std::ops::Range;
use std::rc::Rc;

use chip::Peripherals;
use unicorn_engine::{Arch, ArmCpuModel, Mode, Prot, RegisterARM, Unicorn, uc_error};

use crate::error::Error;
use crate::fault::Fault;
use crate::hooks;
use crate::memory::Array;
use crate::model::Model;
use crate::registers::{Registers, THUMB};
use crate::system::{Cause, System};

/// Regions of registers besides the model's windows: bit-band aliases, peripherals, the private peripheral bus.
const REGISTERS: [(u32, u64); 5] = [
    (0x2200_0000, 0x0200_0000),
    (0x4000_0000, 0x0200_0000),
    (0x4200_0000, 0x0200_0000),
    (0x4400_0000, 0x1C00_0000),
    (0xE000_0000, 0x0010_0000),
];

/// A page outside of the chip's map with the code that clears the exclusive monitor: CLREX, WFI.
const HIDDEN: u32 = 0xF000_0000;
const CLEAR_MONITOR: [u8; 6] = [0xBF, 0xF3, 0x2F, 0x8F, 0x30, 0xBF];

/// The CPU with all state around it.
pub(crate) struct Core<P: 'static> {
    pub(crate) uc: Unicorn<'static, System<P>>,
}

impl<P: Peripherals + 'static> Core<P> {
    pub(crate) fn new(model: Model, peripherals: P) -> Result<Core<P>, Error> {
        let system = System::new(model, peripherals);
        // Not MCLASS: with it the library silently takes a Cortex-M33.
        let mut uc = Unicorn::new_with_data(Arch::ARM, Mode::THUMB, system)?;
        let model = ArmCpuModel::CORTEX_M4 as i32;
        uc.ctl_set_cpu_model(model)?;
        // An empty set of end addresses: none, not even 0, which is an address like any other here.
        uc.ctl_exits_enable()?;
        let mut core = Core { uc };
        core.map()?;
        hooks::install(&mut core.uc)?;
        Ok(core)
    }

    fn map(&mut self) -> Result<(), Error> {
        let memory = Rc::clone(&self.system().memory);
        self.map_array(memory.flash(), memory.flash().range().start, Prot::READ | Prot::EXEC)?;
        self.map_array(memory.flash(), 0, Prot::READ | Prot::EXEC)?;
        self.map_array(memory.ram(), memory.ram().range().start, Prot::ALL)?;
        for window in self.system().model.windows.clone() {
            hooks::map_registers(&mut self.uc, window.start, u64::from(window.end - window.start))?;
        }
        for (base, size) in REGISTERS {
            hooks::map_registers(&mut self.uc, base, size)?;
        }
        self.map_hidden()
    }

    fn map_array(&mut self, array: &Array, at: u32, rights: Prot) -> Result<(), Error> {
        let size = u64::from(array.range().end - array.range().start);
        // SAFETY: the array outlives the engine, whose data holds the memory; `size` is its length.
        unsafe { self.uc.mem_map_ptr(u64::from(at), size, rights, array.pointer()) }?;
        Ok(())
    }

    fn map_hidden(&mut self) -> Result<(), Error> {
        self.uc.mem_map(u64::from(HIDDEN), 4096, Prot::ALL)?;
        self.uc.mem_write(u64::from(HIDDEN), &CLEAR_MONITOR)?;
        Ok(())
    }

    pub(crate) fn system(&self) -> &System<P> {
        self.uc.get_data()
    }

    pub(crate) fn system_mut(&mut self) -> &mut System<P> {
        self.uc.get_data_mut()
    }

    /// Runs from PC until something stops it.
    pub(crate) fn execute(&mut self) -> Cause {
        let pc = self.uc.get(RegisterARM::PC);
        let now = self.system().clock.now();
        self.system_mut().stats.running(now);
        self.system_mut().run.cause = None;
        match self.uc.emu_start(u64::from(pc | 1), 0, 0, 0) {
            Ok(()) => self.system_mut().run.cause.take().unwrap_or(Cause::WaitForInterrupt),
            Err(error) => self.diagnose(error),
        }
    }

    fn diagnose(&self, error: uc_error) -> Cause {
        let address = self.system().run.missed;
        match error {
            uc_error::READ_PROT => Cause::FlashBusy,
            uc_error::READ_UNMAPPED | uc_error::WRITE_UNMAPPED => Cause::Fault(Fault::DataBus { address }),
            uc_error::FETCH_UNMAPPED => Cause::Fault(Fault::Fetch { address }),
            uc_error::FETCH_PROT => Cause::Fault(Fault::Execute { address }),
            _ if self.uc.get(RegisterARM::XPSR) & THUMB == 0 => Cause::Fault(Fault::InvalidState),
            _ => Cause::Fault(Fault::Undefined),
        }
    }

    /// Clears the exclusive monitor, for which the library has no call.
    pub(crate) fn clear_monitor(&mut self) {
        let number = self.uc.get(RegisterARM::IPSR);
        self.uc.set_xpsr(THUMB | number);
        let ran = self.uc.emu_start(u64::from(HIDDEN | 1), 0, 0, 0);
        debug_assert_eq!(ran, Ok(()));
    }

    /// Code in `changed` is not what was translated.
    pub(crate) fn invalidate(&mut self, changed: &Range<u32>) {
        if !changed.is_empty() && self.system_mut().costs.forget(changed) {
            let dropped = self.uc.ctl_remove_cache(u64::from(changed.start), u64::from(changed.end));
            debug_assert_eq!(dropped, Ok(()));
        }
    }

    /// Makes loads from flash stop the CPU, or not.
    pub(crate) fn bar_flash(&mut self, barred: bool) {
        let flash = self.system().model.flash.clone();
        let rights = if barred { Prot::EXEC } else { Prot::READ | Prot::EXEC };
        let size = u64::from(flash.end - flash.start);
        for base in [flash.start, 0] {
            let done = self.uc.mem_protect(u64::from(base), size, rights);
            debug_assert_eq!(done, Ok(()));
        }
        let flushed = self.uc.ctl_flush_tlb();
        debug_assert_eq!(flushed, Ok(()));
    }

    /// Registers after a reset, with SP and PC from the vector table.
    pub(crate) fn reset_registers(&mut self) {
        let start = self.system().model.flash.start;
        let vector = |offset| self.system().memory.word(start + offset).unwrap_or(u32::MAX);
        let (stack, entry) = (vector(0), vector(4));
        // The mask registers can be written in handler mode, whatever the program left in CONTROL.
        self.uc.set_xpsr(THUMB | 3);
        for register in
            [RegisterARM::PRIMASK, RegisterARM::BASEPRI, RegisterARM::FAULTMASK, RegisterARM::CONTROL]
        {
            self.uc.set(register, 0);
        }
        self.uc.set_xpsr(THUMB);
        self.uc.set(RegisterARM::CONTROL, 0);
        self.clear_general_registers();
        self.uc.set(RegisterARM::MSP, stack & !3);
        self.uc.set(RegisterARM::PSP, 0);
        self.uc.set(RegisterARM::LR, u32::MAX);
        self.uc.set(RegisterARM::PC, entry);
        self.system_mut().run.block_end = entry & !1;
    }

    fn clear_general_registers(&mut self) {
        for number in RegisterARM::R0 as i32..=RegisterARM::R12 as i32 {
            let cleared = self.uc.reg_write(number, 0);
            debug_assert_eq!(cleared, Ok(()));
        }
        self.uc.set(RegisterARM::FPSCR, 0);
    }
}
