//! Registers and flags that an instruction reads. A wrong value takes effect at the next instruction that reads it.

use std::collections::BTreeSet;

use anyhow::{Context, Result};
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmCC, ArmOperandType, ArmReg};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{AccessType, Capstone, Insn, InsnDetail, RegId, RegIdInt};

/// Registers and flags that an instruction reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Reads {
    /// The address of the instruction.
    pub(crate) at: u32,
    /// Numbers of the registers R0 to R14.
    pub(crate) registers: BTreeSet<u8>,
    /// Whether the instruction reads a condition flag.
    pub(crate) flags: bool,
}

/// A decoder for the Cortex-M4.
pub(crate) struct Decoder(Capstone);

impl Decoder {
    pub(crate) fn new() -> Result<Decoder> {
        let builder =
            Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        Ok(Decoder(builder.detail(true).build()?))
    }

    /// Registers and flags of each instruction in this code. The code must not begin within an IT block.
    pub(crate) fn reads(&self, at: u32, code: &[u8]) -> Result<Vec<Reads>> {
        self.0.disasm_all(code, at.into())?.iter().map(|instruction| self.of(instruction)).collect()
    }

    fn of(&self, instruction: &Insn<'_>) -> Result<Reads> {
        let detail = self.0.insn_detail(instruction)?;
        Ok(Reads {
            at: u32::try_from(instruction.address())?,
            registers: registers(&detail, instruction)?.into_iter().filter_map(number).collect(),
            flags: reads_flags(&detail, instruction)?,
        })
    }
}

/// Registers of the encoding, such as the stack pointer, and of the operands.
fn registers(detail: &InsnDetail<'_>, instruction: &Insn<'_>) -> Result<Vec<RegId>> {
    let adds = starts_with_one_of(instruction, &SUMS);
    let mut all = detail.regs_read().to_vec();
    for (index, operand) in detail.arch_detail().arm().context(NOT_ARM)?.operands().enumerate() {
        let is_read = operand.access.is_none_or(AccessType::is_readable) || adds && index < 2;
        match operand.op_type {
            ArmOperandType::Mem(place) => all.extend([place.base(), place.index()]),
            ArmOperandType::Reg(register) if is_read => all.push(register),
            _ => (),
        }
    }
    Ok(all)
}

/// Instructions that add a product to a sum in two registers; capstone reports these registers as written only.
const SUMS: [&str; 4] = ["umlal", "umaal", "smlal", "smlsld"];

/// Whether the result depends on a flag: by a condition, by a carry, or by a read of the flags. The instructions of an IT block have the
/// conditions, the IT instruction has none.
fn reads_flags(detail: &InsnDetail<'_>, instruction: &Insn<'_>) -> Result<bool> {
    let condition = detail.arch_detail().arm().context(NOT_ARM)?.cc();
    let is_it = starts_with_one_of(instruction, &["it"]);
    let is_conditional = !is_it && !matches!(condition, ArmCC::ARM_CC_AL | ArmCC::ARM_CC_INVALID);
    let has_carry = starts_with_one_of(instruction, &["adc", "sbc", "rrx"]);
    let names_flags = instruction.op_str().is_some_and(|operands| operands.contains("psr"));
    Ok(is_conditional || has_carry || names_flags && starts_with_one_of(instruction, &["mrs"]))
}

const NOT_ARM: &str = "not an instruction of Arm";

fn starts_with_one_of(instruction: &Insn<'_>, names: &[&str]) -> bool {
    let mnemonic = instruction.mnemonic().unwrap_or_default();
    names.iter().any(|name| mnemonic.starts_with(name))
}

/// R0 to R14 by number.
fn number(register: RegId) -> Option<u8> {
    const REGISTERS: [u32; 15] = [
        ArmReg::ARM_REG_R0,
        ArmReg::ARM_REG_R1,
        ArmReg::ARM_REG_R2,
        ArmReg::ARM_REG_R3,
        ArmReg::ARM_REG_R4,
        ArmReg::ARM_REG_R5,
        ArmReg::ARM_REG_R6,
        ArmReg::ARM_REG_R7,
        ArmReg::ARM_REG_R8,
        ArmReg::ARM_REG_R9,
        ArmReg::ARM_REG_R10,
        ArmReg::ARM_REG_R11,
        ArmReg::ARM_REG_R12,
        ArmReg::ARM_REG_SP,
        ArmReg::ARM_REG_LR,
    ];
    let index = REGISTERS.iter().position(|known| RegId(*known as RegIdInt) == register)?;
    u8::try_from(index).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads(halves: &[u16]) -> Vec<Reads> {
        let code: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        Decoder::new().unwrap().reads(0x2000_1000, &code).unwrap()
    }

    #[test]
    fn read_registers_are_reported_and_no_others() {
        for (halves, registers, name) in [
            (&[0x1888][..], &[1, 2][..], "adds r0, r1, r2"),
            (&[0x2001], &[], "movs r0, #1"),
            (&[0x4408], &[0, 1], "add r0, r1"),
            (&[0x4288], &[0, 1], "cmp r0, r1"),
            (&[0x6048], &[0, 1], "str r0, [r1, #4]"),
            (&[0x6848], &[1], "ldr r0, [r1, #4]"),
            (&[0x5088], &[0, 1, 2], "str r0, [r1, r2]"),
            (&[0x4801], &[], "ldr r0, [pc, #4]"),
            (&[0x9001], &[0, 13], "str r0, [sp, #4]"),
            (&[0xB510], &[4, 13, 14], "push {r4, lr}"),
            (&[0xBD10], &[13], "pop {r4, pc}"),
            (&[0x4770], &[14], "bx lr"),
            (&[0x4798], &[3], "blx r3"),
            (&[0xB108], &[0], "cbz r0"),
            (&[0xC003], &[0, 1], "stmia r0!, {r0, r1}"),
            (&[0xC903], &[1], "ldm r1, {r0, r1}"),
            (&[0xE9C1, 0x2302], &[1, 2, 3], "strd r2, r3, [r1, #8]"),
            (&[0xE9D1, 0x2302], &[1], "ldrd r2, r3, [r1, #8]"),
            (&[0xFBC1, 0x0302], &[0, 1, 2, 3], "smlal r0, r3, r1, r2: both halves of the sum are read"),
            (&[0xFBE1, 0x0362], &[0, 1, 2, 3], "umaal r0, r3, r1, r2"),
            (&[0xFBA1, 0x0302], &[1, 2], "umull r0, r3, r1, r2"),
            (&[0xFB01, 0x3002], &[1, 2, 3], "mla r0, r1, r2, r3"),
            (&[0xF361, 0x0007], &[0, 1], "bfi r0, r1, #0, #8"),
            (&[0xF2C0, 0x0001], &[0], "movt r0, #1: the lower half stays"),
            (&[0xEA40, 0x2011], &[0, 1], "orr.w r0, r0, r1, lsr #8"),
            (&[0xE8DF, 0xF001], &[1], "tbb [pc, r1]"),
            (&[0xF841, 0x0B04], &[0, 1], "str r0, [r1], #4"),
        ] {
            let found = reads(halves);
            assert_eq!(found.len(), 1, "{name}");
            assert_eq!(found[0].registers.iter().copied().collect::<Vec<u8>>(), registers, "{name}");
        }
    }

    #[test]
    fn instructions_that_depend_on_a_flag_are_reported() {
        for (halves, flags, name) in [
            (&[0xD003][..], &[true][..], "beq"),
            (&[0xE003], &[false], "b"),
            (&[0xF000, 0x8001], &[true], "beq.w"),
            (&[0x4148], &[true], "adcs r0, r1"),
            (&[0xEB61, 0x0002], &[true], "sbc r0, r1, r2"),
            (&[0xEA4F, 0x0031], &[true], "rrx r0, r1"),
            (&[0xF3EF, 0x8000], &[true], "mrs r0, apsr"),
            (&[0xF3EF, 0x8010], &[false], "mrs r0, primask"),
            (&[0x2800], &[false], "cmp r0, #0"),
            (&[0x4288], &[false], "cmp r0, r1"),
            (&[0xB108], &[false], "cbz r0"),
            (&[0xBF0C, 0x2203, 0x2304, 0x2505], &[false, true, true, false], "ite eq and one behind"),
        ] {
            let found: Vec<bool> = reads(halves).iter().map(|reads| reads.flags).collect();
            assert_eq!(found, flags, "{name}");
        }
    }
}
