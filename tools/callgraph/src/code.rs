//! The instructions of a function, as far as they call, jump or take stack.

use anyhow::{Context, Result, bail, ensure};
use capstone::arch::arm::{ArchExtraMode, ArchMode, ArmOperand, ArmOperandType, ArmReg};
use capstone::arch::{BuildsCapstone, BuildsCapstoneExtraMode, DetailsArchInsn};
use capstone::{Capstone, Insn, InsnGroupId, InsnGroupIdInt, InsnGroupType, RegId, RegIdInt};

use crate::image::{Function, Image};
use crate::lists::leaves_the_image;
use crate::registers::Registers;

/// A way out of a function into another one.
#[derive(Clone, Debug)]
pub(crate) struct Way {
    /// The instruction.
    pub(crate) at: u32,
    /// The start of the other function.
    pub(crate) to: u32,
    /// The constants on the way.
    pub(crate) registers: Registers,
}

/// A way out of a function through a register that its caller has filled. The compiler's outliner makes a function of
/// lines that other functions share: the constant is theirs.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Through {
    /// The instruction.
    pub(crate) at: u32,
    pub(crate) register: RegId,
}

/// The calls and the stack use of a function.
#[derive(Debug, Default)]
pub(crate) struct Body {
    pub(crate) ways: Vec<Way>,
    pub(crate) through: Vec<Through>,
    /// Bytes that all instructions together take of the stack.
    pub(crate) stack: u32,
    /// Whether one of the instructions takes a number of bytes that a register holds.
    pub(crate) is_variable: bool,
}

const SP: RegId = RegId(ArmReg::ARM_REG_SP as RegIdInt);
const LR: RegId = RegId(ArmReg::ARM_REG_LR as RegIdInt);
pub(crate) const PC: RegId = RegId(ArmReg::ARM_REG_PC as RegIdInt);
const CALL: InsnGroupId = InsnGroupId(InsnGroupType::CS_GRP_CALL as InsnGroupIdInt);
const JUMP: InsnGroupId = InsnGroupId(InsnGroupType::CS_GRP_JUMP as InsnGroupIdInt);

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
        let mut reader = Reader { image, function, registers: Registers::default(), body: Body::default() };
        for (start, end) in image.code(function) {
            self.steps(image.bytes(start, end)?, start, |step| reader.take(step))
                .with_context(|| format!("in {}", function.name))?;
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

    /// Hands the instructions of this code to `take`, one after the other.
    pub(crate) fn steps(
        &self,
        code: &[u8],
        start: u32,
        mut take: impl FnMut(&Step<'_>) -> Result<()>,
    ) -> Result<()> {
        let instructions = self.0.disasm_all(code, start.into())?;
        let read: usize = instructions.iter().map(Insn::len).sum();
        ensure!(read == code.len(), "no instruction at {:#010x}", start as usize + read);
        for instruction in instructions.iter() {
            self.step(instruction, &mut take).with_context(|| instruction.to_string())?;
        }
        Ok(())
    }

    fn step(&self, instruction: &Insn<'_>, take: impl FnOnce(&Step<'_>) -> Result<()>) -> Result<()> {
        let detail = self.0.insn_detail(instruction)?;
        let arch = detail.arch_detail();
        let arm = arch.arm().context("not an instruction of Arm")?;
        let operands: Vec<_> = arm.operands().collect();
        let groups = detail.groups();
        take(&Step {
            at: u32::try_from(instruction.address())?,
            mnemonic: instruction.mnemonic().unwrap_or_default().trim_end_matches(".w"),
            operands: &operands,
            is_branch: groups.contains(&CALL) || groups.contains(&JUMP),
            is_call: groups.contains(&CALL),
            writes_back: arm.writeback(),
        })
    }
}

/// One instruction.
pub(crate) struct Step<'a> {
    pub(crate) at: u32,
    /// The mnemonic without the suffix of a wide encoding.
    pub(crate) mnemonic: &'a str,
    pub(crate) operands: &'a [ArmOperand],
    is_branch: bool,
    /// Whether the instruction comes back: LR then holds the address behind it.
    pub(crate) is_call: bool,
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
    registers: Registers,
    body: Body,
}

impl Reader<'_> {
    fn take(&mut self, step: &Step<'_>) -> Result<()> {
        ensure!(!step.loads_pc(), "jumps through memory");
        match step.target() {
            Some(Target::Address(to)) => self.leave(step.at, to)?,
            Some(Target::Register(register)) => match self.registers.constant(register) {
                Some(to) => self.leave(step.at, to)?,
                None if leaves_the_image(&self.function.name) => {}
                None if self.registers.is_of_caller(register) => {
                    self.body.through.push(Through { at: step.at, register });
                }
                None => bail!("calls through a register that holds no constant"),
            },
            None => {}
        }
        match step.stack() {
            Some(bytes) => self.body.stack += bytes,
            None => self.body.is_variable = true,
        }
        self.registers.learn(step, |address| self.image.word(address))
    }

    fn leave(&mut self, at: u32, to: u32) -> Result<()> {
        let other = self.image.entered(to)?;
        if other.start != self.function.start {
            self.body.ways.push(Way { at, to: other.start, registers: self.registers.clone() });
        }
        Ok(())
    }
}
