//! What the CPU library calls back: before each block, at accesses to peripherals, at traps.

use chip::Peripherals;
use unicorn_engine::{HookType, MemType, RegisterARM, Unicorn};

use crate::error::Error;
use crate::fault::Fault;
use crate::mechanism::Mechanism;
use crate::nvic::THREAD_PRIORITY;
use crate::registers::{IT, Registers};
use crate::system::{Cause, System};

/// Exception numbers of the CPU library (its `target/arm/cpu.h`).
const SUPERVISOR: u32 = 2;
const DATA_ABORT: u32 = 4;
const BREAKPOINT: u32 = 7;
const EXCEPTION_EXIT: u32 = 8;
const UNALIGNED: u32 = 22;

/// The last address that can hold a program's code; what lies above is the core's own.
const LAST_CODE: u64 = 0xDFFF_FFFF;

type Engine<'a, P> = Unicorn<'a, System<P>>;

/// Installs all hooks.
pub(crate) fn install<P: Peripherals + 'static>(uc: &mut Engine<'static, P>) -> Result<(), Error> {
    uc.add_block_hook(0, LAST_CODE, |uc, address, size| on_block(uc, address as u32, size))?;
    uc.add_intr_hook(on_trap)?;
    uc.add_insn_invalid_hook(on_invalid)?;
    let missed = HookType::MEM_UNMAPPED | HookType::MEM_READ_PROT | HookType::MEM_FETCH_PROT;
    uc.add_mem_hook(missed, 0, u64::MAX, on_missed)?;
    uc.add_mem_hook(HookType::MEM_WRITE_PROT, 0, u64::MAX, on_program)?;
    Ok(())
}

/// Maps a region whose accesses go to the peripherals or the system control space.
pub(crate) fn map_registers<P: Peripherals + 'static>(
    uc: &mut Engine<'static, P>,
    base: u32,
    size: u64,
) -> Result<(), Error> {
    let read = move |uc: &mut Engine<'_, P>, offset: u64, size: usize| {
        u64::from(uc.get_data_mut().read(base + offset as u32, size as u8))
    };
    let write = move |uc: &mut Engine<'_, P>, offset: u64, size: usize, value: u64| {
        uc.get_data_mut().write(base + offset as u32, size as u8, value as u32);
    };
    uc.mmio_map(u64::from(base), size, Some(read), Some(write))?;
    Ok(())
}

/// Priority that the mask registers give to what runs.
pub(crate) fn mask_priority<P: Peripherals>(uc: &Engine<'_, P>) -> i16 {
    let system = uc.get_data();
    if uc.get(RegisterARM::FAULTMASK) & 1 != 0 {
        -1
    } else if uc.get(RegisterARM::PRIMASK) & 1 != 0 && system.works(Mechanism::Primask) {
        0
    } else if system.works(Mechanism::Basepri) {
        system.nvic.base_priority(uc.get(RegisterARM::BASEPRI))
    } else {
        THREAD_PRIORITY
    }
}

fn stop<P>(uc: &mut Engine<'_, P>, cause: Cause) {
    uc.get_data_mut().run.cause = Some(cause);
    // Fails only when nothing runs.
    let _ = uc.emu_stop();
}

/// Runs before each basic block. Stopping here stops before the block, and the hook runs again on resumption.
fn on_block<P: Peripherals>(uc: &mut Engine<'_, P>, address: u32, size: u32) {
    let masked = uc.get_data().run.masked;
    if uc.get_data().must_stop(address) || masked.is_some_and(|masked| masked < mask_priority(uc)) {
        stop(uc, Cause::Attention);
    } else if let Err(fault) = uc.get_data_mut().charge(address, size) {
        stop(uc, Cause::Fault(fault));
    }
}

fn on_trap<P>(uc: &mut Engine<'_, P>, number: u32) {
    let cause = match number {
        SUPERVISOR => Cause::Supervisor,
        BREAKPOINT => Cause::Breakpoint,
        // PC is EXC_RETURN without its lowest bit.
        EXCEPTION_EXIT => Cause::Return(uc.get(RegisterARM::PC) | 1),
        DATA_ABORT | UNALIGNED => Cause::Fault(Fault::Unaligned),
        _ => Cause::Fault(Fault::Undefined),
    };
    stop(uc, cause);
}

/// The library reports WFE and YIELD like an undefined instruction, with PC behind them instead of on them. They end
/// their block, so PC is the block's end; an undefined instruction lies inside its block.
fn on_invalid<P>(uc: &mut Engine<'_, P>) -> bool {
    let pc = uc.get(RegisterARM::PC);
    if pc != uc.get_data().run.block_end {
        return false;
    }
    let memory = &uc.get_data().memory;
    let wide = memory.word(pc.wrapping_sub(4)).unwrap_or(0);
    if wide >> 16 == 0xBF20 || wide == 0x8002_F3AF {
        stop(uc, Cause::WaitForEvent);
    }
    true
}

/// Notes the address of an access to nothing, or of one that flash cannot serve now. Not handled: the library stops
/// with PC on the instruction.
fn on_missed<P>(uc: &mut Engine<'_, P>, _: MemType, address: u64, _: usize, _: i64) -> bool {
    uc.get_data_mut().run.missed = address as u32;
    false
}

/// A store into the flash array. The library drops the raw store; the chip decides what becomes of it.
fn on_program<P: Peripherals>(
    uc: &mut Engine<'_, P>,
    _: MemType,
    address: u64,
    size: usize,
    value: i64,
) -> bool {
    let bytes = value.to_le_bytes();
    let address = uc.get_data().flash_address(address as u32);
    uc.get_data_mut().program(address, &bytes[..size.min(8)]);
    // The library has put the IT state of this instruction into the register, where the translated code expects
    // none while it runs a block.
    let xpsr = uc.get(RegisterARM::XPSR);
    if xpsr & IT != 0 {
        uc.set(RegisterARM::XPSR_NZCVQG, xpsr & !IT);
    }
    true
}
