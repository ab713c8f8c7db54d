//! The instructions of a function, as far as they call, jump or take stack.

use std::collections::BTreeMap;

use anyhow::{Context, Result, ensure};
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmOperand, ArmOperandType, ArmReg};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{AccessType, Capstone, Insn, InsnGroupId, InsnGroupIdInt, InsnGroupType, RegId, RegIdInt};

use crate::image::{Function, Image};
use crate::lists::leaves_the_image;

/// A way out of a function into another one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Way {
    /// The instruction.
    pub(crate) at: u32,
    /// The start of the other function.
    pub(crate) to: u32,
}

/// The calls and the stack use of a function.
#[derive(Debug, Default)]
pub(crate) struct Body {
    pub(crate) ways: Vec<Way>,
    /// Bytes that all instructions together take of the stack.
    pub(crate) stack: u32,
    /// Whether one of the instructions takes a number of bytes that a register holds.
    pub(crate) is_variable: bool,
}

const SP: RegId = RegId(ArmReg::ARM_REG_SP as RegIdInt);
const LR: RegId = RegId(ArmReg::ARM_REG_LR as RegIdInt);
const PC: RegId = RegId(ArmReg::ARM_REG_PC as RegIdInt);
const BRANCHES: [InsnGroupId; 2] = [
    InsnGroupId(InsnGroupType::CS_GRP_CALL as InsnGroupIdInt),
    InsnGroupId(InsnGroupType::CS_GRP_JUMP as InsnGroupIdInt),
];

/// An instruction as text.
#[derive(Clone, Debug)]
pub(crate) struct Line {
    pub(crate) at: u32,
    pub(crate) mnemonic: String,
    pub(crate) operands: String,
}

/// A decoder for the Cortex-M4.
pub(crate) struct Decoder(Capstone);

impl Decoder {
    pub(crate) fn new() -> Result<Decoder> {
        let builder =
            Capstone::new().arm().mode(ArchMode::Thumb).extra_mode([ArchExtraMode::MClass].into_iter());
        Ok(Decoder(builder.detail(true).build()?))
    }

    /// Reads a function.
    pub(crate) fn body(&self, image: &Image<'_>, function: &Function) -> Result<Body> {
        let mut reader = Reader { image, function, constants: BTreeMap::new(), body: Body::default() };
        for (start, end) in image.code(function) {
            let bytes = image.bytes(start, end)?;
            let instructions = self.0.disasm_all(bytes, start.into())?;
            let read: usize = instructions.iter().map(Insn::len).sum();
            ensure!(
                read == bytes.len(),
                "no instruction at {:#010x} in {}",
                start as usize + read,
                function.name
            );
            for instruction in instructions.iter() {
                self.take(&mut reader, instruction)
                    .with_context(|| format!("{instruction} in {}", function.name))?;
            }
        }
        Ok(reader.body)
    }

    /// The instructions of a function: address, mnemonic, operands.
    pub(crate) fn list(&self, image: &Image<'_>, function: &Function) -> Result<Vec<Line>> {
        let mut lines = Vec::new();
        for (start, end) in image.code(function) {
            let instructions = self.0.disasm_all(image.bytes(start, end)?, start.into())?;
            for instruction in instructions.iter() {
                lines.push(Line {
                    at: u32::try_from(instruction.address())?,
                    mnemonic: instruction.mnemonic().unwrap_or_default().to_owned(),
                    operands: instruction.op_str().unwrap_or_default().to_owned(),
                });
            }
        }
        Ok(lines)
    }

    fn take(&self, reader: &mut Reader<'_>, instruction: &Insn<'_>) -> Result<()> {
        let detail = self.0.insn_detail(instruction)?;
        let arch = detail.arch_detail();
        let arm = arch.arm().context("not an instruction of Arm")?;
        let operands: Vec<_> = arm.operands().collect();
        reader.take(&Step {
            at: u32::try_from(instruction.address())?,
            mnemonic: instruction.mnemonic().unwrap_or_default().trim_end_matches(".w"),
            operands: &operands,
            is_branch: detail.groups().iter().any(|group| BRANCHES.contains(group)),
            writes_back: arm.writeback(),
        })
    }
}

/// One instruction.
struct Step<'a> {
    at: u32,
    /// The mnemonic without the suffix of a wide encoding.
    mnemonic: &'a str,
    operands: &'a [ArmOperand],
    is_branch: bool,
    writes_back: bool,
}

/// The target of a branch.
enum Target {
    Address(u32),
    Register(RegId),
}

impl Step<'_> {
    /// The target of a branch; `None` for a return and for a jump through a table of the function itself.
    fn target(&self) -> Option<Target> {
        if !self.is_branch {
            return None;
        }
        match self.operands.last()?.op_type {
            ArmOperandType::Imm(address) => Some(Target::Address(address.cast_unsigned())),
            ArmOperandType::Reg(register) if self.mnemonic.starts_with('b') && register != LR => {
                Some(Target::Register(register))
            }
            _ => None,
        }
    }

    /// Bytes that the instruction takes of the stack; `None` when a register holds their number.
    fn stack(&self) -> Option<u32> {
        let count = |operands: &[ArmOperand]| operands.iter().map(size).sum();
        match (self.mnemonic, self.operands) {
            ("push" | "vpush", registers) => Some(count(registers)),
            ("stmdb" | "vstmdb", [base, registers @ ..]) if is(base, SP) && self.writes_back => {
                Some(count(registers))
            }
            ("sub" | "subw", [to, .., by]) if is(to, SP) => match by.op_type {
                ArmOperandType::Imm(bytes) => u32::try_from(bytes).ok(),
                _ => None,
            },
            ("str" | "strd", [.., place]) if self.writes_back => match place.op_type {
                ArmOperandType::Mem(place) if place.base() == SP => Some(place.disp().min(0).unsigned_abs()),
                _ => Some(0),
            },
            _ => Some(0),
        }
    }

    /// Whether the instruction jumps to an address from memory. A word that was pushed is a return address and does not
    /// count.
    fn loads_pc(&self) -> bool {
        match (self.mnemonic, self.operands) {
            ("ldr", [to, from]) if is(to, PC) => {
                !matches!(from.op_type, ArmOperandType::Mem(from) if from.base() == SP)
            }
            _ => false,
        }
    }
}

fn is(operand: &ArmOperand, register: RegId) -> bool {
    operand.op_type == ArmOperandType::Reg(register)
}

/// Bytes of a register.
fn size(operand: &ArmOperand) -> u32 {
    let doubles = ArmReg::ARM_REG_D0..=ArmReg::ARM_REG_D31;
    match operand.op_type {
        ArmOperandType::Reg(register) if doubles.contains(&u32::from(register.0)) => 8,
        _ => 4,
    }
}

/// Reads the instructions of a function one after the other.
struct Reader<'a> {
    image: &'a Image<'a>,
    function: &'a Function,
    /// Registers that hold a constant address. A compiler that optimises for size calls through such a register.
    constants: BTreeMap<RegId, u32>,
    body: Body,
}

impl Reader<'_> {
    fn take(&mut self, step: &Step<'_>) -> Result<()> {
        ensure!(!step.loads_pc(), "jumps through memory");
        match step.target() {
            Some(Target::Address(to)) => self.leave(step.at, to)?,
            Some(Target::Register(register)) => match self.constants.get(&register) {
                Some(&to) => self.leave(step.at, to)?,
                None => ensure!(
                    leaves_the_image(&self.function.name),
                    "calls through a register that holds no constant"
                ),
            },
            None => {}
        }
        match step.stack() {
            Some(bytes) => self.body.stack += bytes,
            None => self.body.is_variable = true,
        }
        self.learn(step)
    }

    fn leave(&mut self, at: u32, to: u32) -> Result<()> {
        let other = self.image.function_at(to).with_context(|| format!("{to:#010x} is in no function"))?;
        if other.start != self.function.start {
            self.body.ways.push(Way { at, to: other.start });
        }
        Ok(())
    }

    /// Notes the constants in registers. Instructions come in the order of their addresses, so that a constant is known
    /// before the calls through its register.
    fn learn(&mut self, step: &Step<'_>) -> Result<()> {
        let known = match (step.mnemonic, step.operands) {
            ("movw", [_, from]) => immediate(from),
            ("movt", [to, from]) => {
                self.constant(to).zip(immediate(from)).map(|(low, high)| high << 16 | low & 0xFFFF)
            }
            ("mov", [_, from]) => self.constant(from),
            ("ldr", [_, from]) => match from.op_type {
                ArmOperandType::Mem(place) if place.base() == PC => {
                    let pc = (step.at & !3) + 4;
                    Some(self.image.word(pc.wrapping_add_signed(place.disp()))?)
                }
                _ => None,
            },
            _ => None,
        };
        for operand in step.operands {
            let is_written = operand.access.is_some_and(AccessType::is_writable);
            if let (ArmOperandType::Reg(register), true) = (&operand.op_type, is_written) {
                self.constants.remove(register);
            }
        }
        if let (Some(ArmOperandType::Reg(register)), Some(value)) =
            (step.operands.first().map(|to| &to.op_type), known)
        {
            self.constants.insert(*register, value);
        }
        Ok(())
    }

    fn constant(&self, operand: &ArmOperand) -> Option<u32> {
        match operand.op_type {
            ArmOperandType::Reg(register) => self.constants.get(&register).copied(),
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
