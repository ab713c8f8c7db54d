//! The constant addresses in registers.

use std::collections::BTreeMap;

use anyhow::Result;
use capstone::arch::arm::{ArmOperand, ArmOperandType, ArmReg};
use capstone::{AccessType, RegId, RegIdInt};

use crate::code::{PC, Step};

/// The registers that a called function may write (AAPCS32, 6.1.1).
const OF_CALLEE: [u32; 6] = [
    ArmReg::ARM_REG_R0,
    ArmReg::ARM_REG_R1,
    ArmReg::ARM_REG_R2,
    ArmReg::ARM_REG_R3,
    ArmReg::ARM_REG_R12,
    ArmReg::ARM_REG_LR,
];

/// The registers that a function has written, and the constants in them. A compiler that optimises for size calls
/// through such a register. Instructions come in the order of their addresses, so that a constant is known before the
/// calls through its register.
#[derive(Clone, Debug, Default)]
pub(crate) struct Registers(BTreeMap<RegId, Option<u32>>);

impl Registers {
    pub(crate) fn constant(&self, register: RegId) -> Option<u32> {
        self.0.get(&register).copied().flatten()
    }

    /// Whether the register has the content that the caller of the function left in it.
    pub(crate) fn is_of_caller(&self, register: RegId) -> bool {
        !self.0.contains_key(&register)
    }

    /// Notes what an instruction leaves in the registers. `word` reads a constant of the image.
    pub(crate) fn learn(&mut self, step: &Step<'_>, word: impl Fn(u32) -> Result<u32>) -> Result<()> {
        let known = match (step.mnemonic, step.operands) {
            ("movw", [_, from]) => immediate(from),
            ("movt", [to, from]) => {
                self.held(to).zip(immediate(from)).map(|(low, high)| high << 16 | low & 0xFFFF)
            }
            ("mov", [_, from]) => self.held(from),
            ("ldr", [_, from]) => match from.op_type {
                ArmOperandType::Mem(place) if place.base() == PC => {
                    let pc = (step.at & !3) + 4;
                    Some(word(pc.wrapping_add_signed(place.disp()))?)
                }
                _ => None,
            },
            _ => None,
        };
        if step.is_call {
            self.0.extend(OF_CALLEE.map(|register| (RegId(register as RegIdInt), None)));
        }
        for operand in step.operands {
            let is_written = operand.access.is_some_and(AccessType::is_writable);
            if let (ArmOperandType::Reg(register), true) = (&operand.op_type, is_written) {
                self.0.insert(*register, None);
            }
        }
        if let (Some(ArmOperandType::Reg(register)), Some(value)) =
            (step.operands.first().map(|to| &to.op_type), known)
        {
            self.0.insert(*register, Some(value));
        }
        Ok(())
    }

    fn held(&self, operand: &ArmOperand) -> Option<u32> {
        match operand.op_type {
            ArmOperandType::Reg(register) => self.constant(register),
            _ => None,
        }
    }
}

fn immediate(operand: &ArmOperand) -> Option<u32> {
    match operand.op_type {
        ArmOperandType::Imm(value) => Some(value.cast_unsigned()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::Decoder;

    const R0: RegId = RegId(ArmReg::ARM_REG_R0 as RegIdInt);
    const R9: RegId = RegId(ArmReg::ARM_REG_R9 as RegIdInt);
    /// `movw r0, #0x5678`, `movt r0, #0x1234`, `mov r9, r0`.
    const CONSTANT: [u8; 10] = [0x45, 0xF2, 0x78, 0x60, 0xC1, 0xF2, 0x34, 0x20, 0x81, 0x46];

    /// The registers after these instructions, which begin at 0x100.
    fn after(code: &[u8]) -> Registers {
        let mut registers = Registers::default();
        Decoder::new().unwrap().steps(code, 0x100, |step| registers.learn(step, Ok)).unwrap();
        registers
    }

    #[test]
    fn a_constant_is_known_until_its_register_is_written() {
        let added = [&CONSTANT[..], &[0x01, 0x30]].concat();
        assert_eq!(after(&CONSTANT).constant(R0), Some(0x1234_5678));
        assert_eq!(after(&added).constant(R9), Some(0x1234_5678));
        assert_eq!(after(&added).constant(R0), None);
        assert!(!after(&added).is_of_caller(R0), "adds r0, #1");
    }

    #[test]
    fn a_call_leaves_what_the_callee_has_to_preserve() {
        let called = after(&[&CONSTANT[..], &[0x00, 0xF0, 0x00, 0xF8]].concat());
        assert_eq!((called.constant(R0), called.constant(R9)), (None, Some(0x1234_5678)));
        assert!(!called.is_of_caller(R0) && after(&[]).is_of_caller(R9));
    }

    #[test]
    fn a_load_relative_to_the_program_counter_is_a_constant() {
        assert_eq!(after(&[0x01, 0x48]).constant(R0), Some(0x108), "ldr r0, [pc, #4]");
    }
}
