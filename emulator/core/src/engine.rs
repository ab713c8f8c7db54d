//! The CPU library: memory map, hooks and registers. `Core::halt` holds the reason of a stop.

use chip::{Effect, Peripherals};
use unicorn_engine::{
    Arch, ArmCpuModel, HookType, MemType, Mode, Prot, RegisterARM, TlbEntry, TlbType, UcHookId, Unicorn,
    uc_error,
};

use crate::clock::{self, Library};
use crate::core::{Core, Halt, Unmapped};
use crate::mechanism::Mechanism;
use crate::model::{Error, Model};
use crate::{alignment, posted, ppb, stepping};

pub(crate) type Cpu<P> = Unicorn<'static, Core<P>>;

/// A page for the emulator's own code, outside everything that the chip has.
pub(crate) const HIDDEN: u64 = 0x1F00_0000;
/// The end address of every run; no program reaches it.
pub(crate) const NOWHERE: u64 = 1 << 32;
/// `clrex; wfi`
const CLREX: [u8; 6] = [0xBF, 0xF3, 0x2F, 0x8F, 0x30, 0xBF];

/// The first address above flash.
pub(crate) const RAM: u32 = 0x2000_0000;

/// The bus of the flash controller's registers.
const FLASH_CONTROLLER: u32 = 0x4002_3C00;

/// YIELD and WFE.
const HINTS: [u16; 2] = [0xBF10, 0xBF20];
/// The upper byte of the instruction UDF.
const UDF: u16 = 0xDE;

/// Makes a CPU with the memory of `model`.
pub(crate) fn new<P: Peripherals + 'static>(model: &Model, core: Core<P>) -> Result<Cpu<P>, Error> {
    let mut cpu = Unicorn::new_with_data(Arch::ARM, Mode::THUMB, core)?;
    cpu.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
    let length = |range: &std::ops::Range<u32>| u64::from(range.end - range.start);
    let (flash, ram) = (cpu.get_data().memory.flash.pointer(), cpu.get_data().memory.ram.pointer());
    // SAFETY: both blocks have the length of their range and live in the core, which outlives the library's handle.
    unsafe {
        cpu.mem_map_ptr(model.flash.start.into(), length(&model.flash), Prot::READ | Prot::EXEC, flash)?;
        cpu.mem_map_ptr(model.ram.start.into(), length(&model.ram), Prot::ALL, ram)?;
    }
    // This call is needed: the mapping alone does not make the library drop stores.
    cpu.mem_protect(model.flash.start.into(), length(&model.flash), Prot::READ | Prot::EXEC)?;
    cpu.mem_map(HIDDEN, 0x1000, Prot::READ | Prot::EXEC)?;
    cpu.mem_write(HIDDEN, &CLREX)?;
    for range in &model.peripherals {
        map_peripherals(&mut cpu, range.start, range.end - range.start)?;
    }
    map_bit_band(&mut cpu, 0x4200_0000, 0x4000_0000)?;
    map_system(&mut cpu)?;
    add_hooks(&mut cpu, model)?;
    Ok(cpu)
}

fn add_hooks<P: Peripherals + 'static>(cpu: &mut Cpu<P>, model: &Model) -> Result<(), Error> {
    clock::charge_blocks(cpu)?;
    cpu.add_intr_hook(on_interrupt)?;
    cpu.add_insn_invalid_hook(on_invalid)?;
    cpu.ctl_set_tlb_type(TlbType::VIRTUAL)?;
    cpu.add_tlb_hook(1, 0, on_page)?;
    // RAM gets no hook: with one, the library would check every store.
    let (below, above) = (u64::from(model.ram.start) - 1, u64::from(model.ram.end));
    for (first, last) in [(0, below), (above, u64::from(u32::MAX))] {
        cpu.add_mem_hook(HookType::MEM_UNMAPPED, first, last, on_unmapped)?;
    }
    let flash = model.flash.clone();
    cpu.add_mem_hook(HookType::MEM_WRITE_PROT, flash.start.into(), (flash.end - 1).into(), on_flash_write)?;
    Ok(())
}

/// From now on, counts the cycles of every instruction by itself.
pub(crate) fn step_instructions<P: Peripherals + 'static>(cpu: &mut Cpu<P>) -> Result<(), Error> {
    cpu.add_code_hook(1, 0, on_instruction)?;
    Ok(cpu.ctl_flush_tb()?)
}

/// The hook of the mode in which interrupts come between any two instructions.
fn on_instruction<P: Peripherals>(cpu: &mut Unicorn<Core<P>>, address: u64, size: u32) {
    let place = address as u32;
    let Some(stepping) = &mut cpu.get_data_mut().stepping else { return };
    if address & !0xFFF == HIDDEN || stepping.is_charged(place) {
        return;
    }
    if let Some(exception) = stepping.arrived(place) {
        cpu.get_data_mut().pend(exception);
    }
    let mut code = [0; stepping::LONGEST_BLOCK];
    let charged = cpu.get_data().memory.read(place, &mut code).map_or(size, |()| stepping::length(&code));
    let ccr = cpu.get_data().scb.ccr;
    if let Some(status) = alignment::fault(&code, ccr, |number| core_register(cpu, number)) {
        let library = Library::of(cpu);
        clock::refuse(library, cpu.get_data_mut(), status);
    } else if clock::pass(Library::of(cpu), cpu.get_data_mut(), place, charged) {
        let core = cpu.get_data_mut();
        let wait = core.stepping.as_mut().map_or(0, |stepping| {
            stepping.charged(place, size, charged);
            stepping.wait()
        });
        core.spend(0, wait);
        if posted::is_barrier(&code) {
            core.wait_at_barrier(place);
        }
    }
}

/// Counts wait cycles for constants in flash.
pub(crate) fn watch_constants<P: Peripherals + 'static>(
    cpu: &mut Cpu<P>,
    model: &Model,
) -> Result<(), Error> {
    let (first, last) = (model.flash.start.into(), u64::from(model.flash.end) - 1);
    cpu.add_mem_hook(HookType::MEM_READ, first, last, |cpu, _, address, _, _| {
        close_it_block(cpu);
        cpu.get_data_mut().wait_for_constant(address as u32);
        true
    })?;
    Ok(cpu.ctl_flush_tb()?)
}

/// Calls the [`crate::watch::Watch`] before every instruction.
pub(crate) fn watch<P: Peripherals + 'static>(cpu: &mut Cpu<P>) -> Result<UcHookId, Error> {
    let hook = cpu.add_code_hook(1, 0, on_watched)?;
    cpu.ctl_flush_tb()?;
    Ok(hook)
}

/// The hook for watched points. When the program has stopped for another reason, the instruction comes here again
/// later.
fn on_watched<P: Peripherals>(cpu: &mut Unicorn<Core<P>>, address: u64, size: u32) {
    let core = cpu.get_data_mut();
    if address & !0xFFF == HIDDEN || core.halt.is_some() {
        return;
    }
    let mut code = [0; stepping::LONGEST_BLOCK];
    let block = core.memory.read(address as u32, &mut code).map_or(size, |()| stepping::length(&code));
    if core.watch.as_mut().is_some_and(|watch| watch.stops_before(address as u32, size, block)) {
        core.stop_for(Halt::Watched);
        let _ = cpu.emu_stop();
    }
}

/// The value of R0 to R14 by number.
pub(crate) fn core_register<P>(cpu: &Unicorn<Core<P>>, number: u16) -> u32 {
    let register = match number {
        0..=12 => RegisterARM::R0 as i32 + i32::from(number),
        13 => RegisterARM::SP as i32,
        _ => RegisterARM::LR as i32,
    };
    cpu.reg_read(register).unwrap_or(0) as u32
}

/// Makes loads from a busy flash fail, or allows them again.
pub(crate) fn close_flash<P: Peripherals>(cpu: &mut Cpu<P>, model: &Model, closed: bool) {
    if cpu.get_data().flash_closed != closed {
        let protection = if closed { Prot::EXEC } else { Prot::READ | Prot::EXEC };
        let _ = cpu.mem_protect(model.flash.start.into(), model.flash.len() as u64, protection);
        // The library has cached the rights of the pages.
        let _ = cpu.ctl_flush_tlb();
        cpu.get_data_mut().flash_closed = closed;
    }
}

fn on_interrupt<P: Peripherals>(cpu: &mut Unicorn<Core<P>>, number: u32) {
    // The numbers are QEMU's, from target/arm/cpu.h.
    cpu.get_data_mut().stop_for(match number {
        2 => Halt::SupervisorCall,
        7 => Halt::Breakpoint,
        8 => Halt::ExceptionReturn,
        _ => Halt::Undefined,
    });
    let _ = cpu.emu_stop();
}

/// The library reports WFE and YIELD as invalid instructions, with the program counter already behind them. Both are
/// hints, so the program may always continue.
fn on_invalid<P>(cpu: &mut Unicorn<Core<P>>) -> bool {
    let pc = cpu.pc_read().unwrap_or(0) & !1;
    let op = |address: u64| {
        let mut op = [0; 2];
        cpu.mem_read(address, &mut op).map_or(0, |()| u16::from_le_bytes(op))
    };
    let undefined = op(pc) >> 8 == UDF;
    HINTS.contains(&op(pc.wrapping_sub(2))) && !undefined
}

fn on_unmapped<P>(cpu: &mut Unicorn<Core<P>>, kind: MemType, address: u64, _: usize, _: i64) -> bool {
    let fetch = matches!(kind, MemType::FETCH_UNMAPPED);
    let store = matches!(kind, MemType::WRITE_UNMAPPED);
    cpu.get_data_mut().unmapped = Some(Unmapped { address: address as u32, fetch, store });
    false
}

/// A store into flash: the flash controller decides the effect, and the raw store is dropped.
fn on_flash_write<P: Peripherals>(
    cpu: &mut Unicorn<Core<P>>,
    _: MemType,
    address: u64,
    size: usize,
    value: i64,
) -> bool {
    let mut old = [0; 8];
    let Some(old) = old.get_mut(..size) else { return true };
    let _ = cpu.mem_read(address, old);
    let new = &value.to_le_bytes()[..size];
    let core = cpu.get_data_mut();
    // The flash controller has got all that the program has told it before.
    core.wait_for_stores(FLASH_CONTROLLER);
    let result = core.chip.program(address as u32, old, new, core.now);
    core.finish_store(address as u32, result.ok());
    // The next store of the same block sees what this one has programmed; the rest of the effect comes after the block.
    if let Some(Effect::Store { address, bytes }) = core.programmed() {
        let _ = core.memory.write(address, &bytes);
    }
    true
}

/// Ends a load from the chip. A load seldom changes anything.
fn finish_load<P: Peripherals>(core: &mut Core<P>, address: u32, answered: bool) {
    if !answered {
        core.stop_for(Halt::DataFault(address));
    }
    if core.chip.take_change() {
        core.settle();
    }
}

fn map_peripherals<P: Peripherals + 'static>(cpu: &mut Cpu<P>, base: u32, size: u32) -> Result<(), Error> {
    let read = move |cpu: &mut Unicorn<Core<P>>, offset: u64, size: usize| {
        let core = cpu.get_data_mut();
        let address = base + offset as u32;
        if !core.bugs.ignores_order(address) {
            core.wait_for_stores(address);
            core.wait_for_bus(address, true);
        }
        let value = core.chip.read(address, size as u8, core.now);
        finish_load(core, address, value.is_ok());
        u64::from(core.bugs.seen(address, value.unwrap_or(0)))
    };
    let write = move |cpu: &mut Unicorn<Core<P>>, offset: u64, size: usize, value: u64| {
        let core = cpu.get_data_mut();
        let address = base + offset as u32;
        let Some(value) = core.bugs.stored(address, size, value as u32) else { return };
        core.send(address, size, value);
    };
    cpu.mmio_map(base.into(), size.into(), Some(read), Some(write))?;
    Ok(())
}

/// The alias in which every word is one bit of a peripheral register (ARMv7-M, B3.1; PM0214, 2.2.5).
fn map_bit_band<P: Peripherals + 'static>(cpu: &mut Cpu<P>, alias: u32, base: u32) -> Result<(), Error> {
    let target = move |offset: u64| (base + (offset as u32 >> 5 & !3), offset as u32 >> 2 & 31);
    let read = move |cpu: &mut Unicorn<Core<P>>, offset: u64, _: usize| {
        let (address, bit) = target(offset);
        let core = cpu.get_data_mut();
        core.wait_for_stores(address);
        core.wait_for_bus(address, true);
        let value = core.chip.read(address, 4, core.now);
        finish_load(core, address, value.is_ok());
        u64::from(value.unwrap_or(0) >> bit & 1)
    };
    let write = move |cpu: &mut Unicorn<Core<P>>, offset: u64, _: usize, value: u64| {
        let (address, bit) = target(offset);
        let core = cpu.get_data_mut();
        core.wait_for_stores(address);
        core.wait_for_bus(address, true);
        let old = core.chip.read(address, 4, core.now);
        let Ok(old) = old else { return core.finish_store(address, None) };
        let new = old & !(1 << bit) | (value as u32 & 1) << bit;
        let Some(new) = core.bugs.stored(address, 4, new) else { return };
        core.send(address, 4, new);
    };
    cpu.mmio_map(alias.into(), 0x0200_0000, Some(read), Some(write))?;
    Ok(())
}

fn map_system<P: Peripherals + 'static>(cpu: &mut Cpu<P>) -> Result<(), Error> {
    let read = |cpu: &mut Unicorn<Core<P>>, offset: u64, size: usize| {
        let ipsr = ipsr(cpu);
        let address = ppb::BASE + offset as u32;
        let refused = is_unprivileged(cpu, ipsr);
        let core = cpu.get_data_mut();
        if refused {
            core.finish_store(address, None);
            return 0;
        }
        core.deliver();
        let word = core.ppb_read(address & !3, ipsr);
        core.finish_store(address, word.map(|_| ()));
        let value = word.unwrap_or(0) >> (8 * (address & 3));
        u64::from(if size < 4 { value & ((1 << (8 * size)) - 1) } else { value })
    };
    let write = |cpu: &mut Unicorn<Core<P>>, offset: u64, size: usize, value: u64| {
        let address = ppb::BASE + offset as u32;
        let refused = is_unprivileged(cpu, ipsr(cpu));
        let core = cpu.get_data_mut();
        if refused {
            return core.finish_store(address, None);
        }
        let Some(value) = core.bugs.stored(address, size, value as u32) else { return };
        core.deliver();
        let word = match address & !3 {
            // Bits that are written as 1 are cleared: the other bytes are not written.
            ppb::CFSR => Some(value << (8 * (address & 3))),
            _ if size == 4 => Some(value),
            _ => merged(core, address, size, value),
        };
        let result = word.and_then(|word| core.ppb_write(address & !3, word));
        core.finish_store(address, result);
        if (ppb::MPU..=ppb::MPU_END).contains(&(address & !3)) {
            // The rights of pages must be queried again, and translated code is dropped before the next block.
            core.memory.protection_is_new = true;
            core.stop_for(Halt::Attention);
            let _ = cpu.ctl_flush_tlb();
        }
    };
    cpu.mmio_map(ppb::BASE.into(), ppb::SIZE.into(), Some(read), Some(write))?;
    Ok(())
}

fn ipsr<P>(cpu: &Unicorn<Core<P>>) -> u32 {
    cpu.reg_read(RegisterARM::IPSR).unwrap_or(0) as u32 & 0x1FF
}

/// Whether the access is unprivileged: it then reaches no register of the system space (ARMv7-M, B3.1.1).
fn is_unprivileged<P>(cpu: &Unicorn<Core<P>>, ipsr: u32) -> bool {
    ipsr == 0 && cpu.reg_read(RegisterARM::CONTROL).unwrap_or(0) & 1 != 0
}

/// A byte or halfword merged into its word; the priority registers are written in this way.
fn merged<P: Peripherals>(core: &mut Core<P>, address: u32, size: usize, value: u32) -> Option<u32> {
    let shift = 8 * (address & 3);
    let mask = ((1_u32 << (8 * size)) - 1) << shift;
    Some(core.ppb_read(address & !3, 0)? & !mask | value << shift & mask)
}

/// The rights of a page, when the library asks for them. The library checks whether stores into a page with code change
/// the code, which makes these stores several times slower. So a page of RAM counts as code only after code was fetched
/// from it.
fn on_page<P: Peripherals>(cpu: &mut Unicorn<Core<P>>, page: u64, kind: MemType) -> Option<TlbEntry> {
    if !matches!(kind, MemType::FETCH) {
        close_it_block(cpu);
    }
    let core = cpu.get_data_mut();
    let address = page as u32;
    let data = core.scb.mpu.data_rights(address);
    let is_denied = match kind {
        MemType::FETCH => false,
        MemType::WRITE => data.0 & Prot::WRITE.0 == 0,
        _ => data.0 & Prot::READ.0 == 0,
    };
    core.denied = is_denied.then_some(address).or(core.denied);
    if !core.scb.mpu.allows_code(address) && !core.lacks(Mechanism::ExecuteNever) {
        return Some(TlbEntry { paddr: page, perms: data });
    }
    let memory = &mut core.memory;
    let has_code = !memory.ram.range.contains(&address) || memory.code_in_ram.contains(&address);
    let fetched = matches!(kind, MemType::FETCH);
    if fetched && !has_code {
        memory.code_in_ram.push(address);
    }
    let perms = if has_code || fetched { data | Prot::EXEC } else { data };
    Some(TlbEntry { paddr: page, perms })
}

/// Before the library asks for a page or calls a hook, it writes the IT state of the access into the CPU. Translated
/// code does not expect this state: the next block would begin with it and skip instructions. The state can be cleared,
/// because code that continues or faults after the access keeps its IT state elsewhere.
fn close_it_block<P>(cpu: &mut Unicorn<Core<P>>) {
    const IT: u64 = 0x0600_FC00;
    let xpsr = cpu.reg_read(RegisterARM::XPSR).unwrap_or(0);
    if xpsr & IT != 0 {
        let _ = cpu.reg_write(RegisterARM::XPSR_NZCVQG, xpsr & !IT);
    }
}

/// Treats RAM as data again, when a new program has begun and runs from flash.
pub(crate) fn forget_code_in_ram<P: Peripherals>(cpu: &mut Cpu<P>, pc: u32) {
    let memory = &mut cpu.get_data_mut().memory;
    if !memory.code_is_old || pc >= RAM {
        return;
    }
    memory.code_is_old = false;
    if !memory.code_in_ram.is_empty() {
        // Drop the code translated from RAM: from now on no check notices its changes.
        let ram = memory.ram.range.clone();
        let _ = cpu.ctl_remove_cache(ram.start.into(), ram.end.into());
        // To the library, a search for translated code counts as a fetch.
        cpu.get_data_mut().memory.code_in_ram.clear();
        let _ = cpu.ctl_flush_tlb();
        cpu.get_data_mut().costs.forget(ram.start, ram.end);
    }
}

/// Applies a changed protection: code translated from RAM may be data from now on, and no check would notice its
/// changes.
pub(crate) fn follow_protection<P: Peripherals>(cpu: &mut Cpu<P>) {
    let core = cpu.get_data_mut();
    if !std::mem::take(&mut core.memory.protection_is_new) {
        return;
    }
    // To the library, a search for translated code counts as a fetch.
    let mpu = std::mem::take(&mut core.scb.mpu);
    let (flash, ram) = (core.memory.flash.range.clone(), core.memory.ram.range.clone());
    let is_stale = std::mem::take(&mut core.memory.code_is_stale) && !core.lacks(Mechanism::Retranslation);
    for range in [ram].into_iter().chain(is_stale.then_some(flash)) {
        let _ = cpu.ctl_remove_cache(range.start.into(), range.end.into());
        cpu.get_data_mut().costs.forget(range.start, range.end);
    }
    let core = cpu.get_data_mut();
    core.scb.mpu = mpu;
    core.memory.code_in_ram.clear();
    let _ = cpu.ctl_flush_tlb();
}

/// Clears the exclusive monitor, as exception entry and return do (ARMv7-M, A3.4). Does nothing if no exclusive access
/// has begun.
pub(crate) fn clear_monitor<P: Peripherals>(cpu: &mut Cpu<P>) -> Result<(), Error> {
    let begun = std::mem::take(&mut cpu.get_data_mut().exclusive);
    if begun && !cpu.get_data().lacks(Mechanism::ExclusiveMonitor) {
        cpu.get_data_mut().clearing_monitor = true;
        let result = cpu.emu_start(HIDDEN | 1, NOWHERE, 0, 0);
        cpu.get_data_mut().clearing_monitor = false;
        result?;
    }
    Ok(())
}

/// Writes memory without the CPU and drops the code translated from it.
pub(crate) fn store<P: Peripherals>(cpu: &mut Cpu<P>, address: u32, bytes: &[u8]) -> Result<(), Error> {
    let core = cpu.get_data_mut();
    core.memory.write(address, bytes).ok_or(uc_error::WRITE_UNMAPPED)?;
    core.flash_changes += u64::from(address < RAM);
    let has_code = address < RAM || !core.memory.code_in_ram.is_empty();
    // In memory without execute rights the library finds no translated code; the code is dropped when the protection
    // changes.
    let is_protected = !core.scb.mpu.allows_code(address);
    core.memory.code_is_stale |= has_code && is_protected;
    if has_code && !is_protected && !core.lacks(Mechanism::Retranslation) {
        if address < RAM {
            core.costs.forget(address, address + bytes.len() as u32);
        }
        let end = u64::from(address) + bytes.len() as u64;
        cpu.ctl_remove_cache(address.into(), end)?;
    }
    Ok(())
}

/// Carries out an effect on memory; returns any other effect.
pub(crate) fn apply<P: Peripherals>(cpu: &mut Cpu<P>, effect: Effect) -> Result<Option<Effect>, Error> {
    let (address, bytes) = match effect {
        Effect::Store { address, bytes } => (address, bytes),
        Effect::Fill { range, byte } => (range.start, vec![byte; range.len()]),
        other => return Ok(Some(other)),
    };
    if let Some(accelerator) = cpu.get_data_mut().accelerator.as_mut().filter(|_| address < RAM) {
        accelerator.change(address, bytes.len() as u32);
    }
    store(cpu, address, &bytes).map(|()| None)
}
