//! What a basic block costs: its instructions exactly, its cycles by a model of the Cortex-M4's timing table
//! (Cortex-M4 TRM, section 3.3.1).
//!
//! The model: one cycle an instruction, more for memory, division and the FPU; two cycles to refill the pipeline
//! after a jump are charged by the machine, which knows where the next block starts; flash wait states are hidden
//! by the ART accelerator. It was not checked against hardware.

use std::ops::Range;

use crate::memory::Memory;

/// Cost of a block, and what it contains that the machine has to know about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cost {
    pub(crate) instructions: u32,
    pub(crate) cycles: u32,
    /// It holds LDREX, LDREXB or LDREXH.
    pub(crate) exclusive: bool,
    /// It holds SEV.
    pub(crate) event: bool,
    /// It holds an FPU instruction.
    pub(crate) float: bool,
}

/// Costs of blocks already met, in a direct-mapped table.
pub(crate) struct Costs {
    entries: Vec<Entry>,
    /// All addresses that entries were made for.
    covered: Range<u32>,
}

#[derive(Clone, Copy, Default)]
struct Entry {
    address: u32,
    size: u32,
    cost: Cost,
}

const ENTRIES: usize = 1 << 14;

impl Costs {
    pub(crate) fn new() -> Costs {
        Costs { entries: vec![Entry::default(); ENTRIES], covered: u32::MAX..0 }
    }

    /// The cost of a block, `None` when it does not lie in memory.
    #[inline]
    pub(crate) fn of(&mut self, address: u32, size: u32, memory: &Memory) -> Option<Cost> {
        let entry = &self.entries[address as usize >> 1 & (ENTRIES - 1)];
        if entry.address == address && entry.size == size {
            return Some(entry.cost);
        }
        self.learn(address, size, memory)
    }

    #[cold]
    fn learn(&mut self, address: u32, size: u32, memory: &Memory) -> Option<Cost> {
        let mut code = vec![0; size as usize];
        memory.load(address, &mut code).ok()?;
        let cost = cost_of(&code);
        self.covered = self.covered.start.min(address)..self.covered.end.max(address + size);
        self.entries[address as usize >> 1 & (ENTRIES - 1)] = Entry { address, size, cost };
        Some(cost)
    }

    /// Forgets what it knows of a range that changed; whether code may have run from it.
    pub(crate) fn forget(&mut self, changed: &Range<u32>) -> bool {
        if changed.end <= self.covered.start || self.covered.end <= changed.start {
            return false;
        }
        for entry in &mut self.entries {
            if entry.address < changed.end && changed.start < entry.address + entry.size {
                *entry = Entry::default();
            }
        }
        true
    }
}

fn cost_of(code: &[u8]) -> Cost {
    let mut halfwords = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut total = Cost::default();
    while let Some(first) = halfwords.next() {
        let cycles = if is_wide(first) {
            let instruction = u32::from(first) << 16 | u32::from(halfwords.next().unwrap_or(0));
            total.exclusive |= is_exclusive_load(instruction);
            total.float |= is_float(instruction);
            wide(instruction)
        } else {
            total.event |= first == 0xBF40;
            narrow(first)
        };
        total.instructions += 1;
        total.cycles += cycles;
    }
    total
}

/// Whether a halfword is the first of a 32-bit instruction (ARMv7-M ARM, A5.1).
fn is_wide(first: u16) -> bool {
    first >> 11 >= 0b11101
}

/// LDREX, or LDREXB and LDREXH.
fn is_exclusive_load(instruction: u32) -> bool {
    instruction & 0xFFF0_0F00 == 0xE850_0F00 || instruction & 0xFFF0_0FE0 == 0xE8D0_0F40
}

/// An instruction of coprocessor 10 or 11.
fn is_float(instruction: u32) -> bool {
    instruction & 0xEC00_0E00 == 0xEC00_0A00
}

/// How a class of instructions is charged.
#[derive(Clone, Copy)]
enum Charge {
    Fixed(u32),
    /// One cycle and one for each register of the mask in these bits.
    List(u32),
    /// One cycle and one for each word of VLDM's count.
    Words,
}

type Class = (u32, u32, Charge);

/// 16-bit instructions that take more than one cycle: mask, value, charge (ARMv7-M ARM, A5.2).
const NARROW: [Class; 9] = [
    (0xF800, 0x4800, Charge::Fixed(2)),    // LDR literal
    (0xFE00, 0x5600, Charge::Fixed(2)),    // LDRSB register
    (0xF800, 0x5800, Charge::Fixed(2)),    // LDR, LDRH register
    (0xF800, 0x5C00, Charge::Fixed(2)),    // LDRB, LDRSH register
    (0xE800, 0x6800, Charge::Fixed(2)),    // LDR, LDRB immediate
    (0xE800, 0x8800, Charge::Fixed(2)),    // LDRH immediate, LDR from SP
    (0xFE00, 0xB400, Charge::List(0x1FF)), // PUSH
    (0xFE00, 0xBC00, Charge::List(0x1FF)), // POP
    (0xF000, 0xC000, Charge::List(0x0FF)), // LDM, STM
];

/// 32-bit instructions that take more than one cycle (ARMv7-M ARM, A5.3).
const WIDE: [Class; 12] = [
    (0xFE40_0000, 0xE800_0000, Charge::List(0xFFFF)), // LDM, STM
    (0xFF70_0000, 0xE850_0000, Charge::Fixed(2)),     // LDREX
    (0xFFF0_00E0, 0xE8D0_0000, Charge::Fixed(3)),     // TBB, TBH
    (0xFFF0_0000, 0xE8D0_0000, Charge::Fixed(2)),     // LDREXB, LDREXH
    (0xFE40_0000, 0xE840_0000, Charge::Fixed(3)),     // LDRD, STRD
    (0xFE10_0000, 0xF810_0000, Charge::Fixed(2)),     // loads of one register
    (0xFFD0_00F0, 0xFB90_00F0, Charge::Fixed(7)),     // SDIV, UDIV
    (0xFFB0_0E50, 0xEE80_0A00, Charge::Fixed(14)),    // VDIV
    (0xFFBF_0ED0, 0xEEB1_0AC0, Charge::Fixed(14)),    // VSQRT
    (0xFF30_0E00, 0xEE00_0A00, Charge::Fixed(3)),     // VMLA, VMLS and their relatives
    (0xFF20_0E00, 0xED00_0A00, Charge::Fixed(2)),     // VLDR, VSTR
    (0xFE00_0E00, 0xEC00_0A00, Charge::Words),        // VLDM, VSTM, VPUSH, VPOP
];

fn narrow(instruction: u16) -> u32 {
    charge(&NARROW, u32::from(instruction))
}

fn wide(instruction: u32) -> u32 {
    charge(&WIDE, instruction)
}

fn charge(classes: &[Class], instruction: u32) -> u32 {
    let class = classes.iter().find(|(mask, value, _)| instruction & mask == *value);
    match class.map(|&(_, _, charge)| charge) {
        None => 1,
        Some(Charge::Fixed(cycles)) => cycles,
        Some(Charge::List(registers)) => 1 + (instruction & registers).count_ones(),
        Some(Charge::Words) => 1 + (instruction & 0xFF),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(halfwords: &[u16]) -> Cost {
        cost_of(&halfwords.iter().flat_map(|half| half.to_le_bytes()).collect::<Vec<_>>())
    }

    #[test]
    fn plain_instructions() {
        // adds r0, #1; ldr r1, [r0]; str r1, [r0]; push {r4, lr}; bx lr
        let cost = block(&[0x3001, 0x6801, 0x6001, 0xB510, 0x4770]);
        assert_eq!((cost.instructions, cost.cycles), (5, 1 + 2 + 1 + 3 + 1));
    }

    #[test]
    fn wide_instructions() {
        assert_eq!(block(&[0xFBB0, 0xF0F1]).cycles, 7); // udiv r0, r0, r1
        assert_eq!(block(&[0xE92D, 0x4FF0]).cycles, 10); // push {r4-r11, lr}
        assert_eq!(block(&[0xEE80, 0x0A20]).cycles, 14); // vdiv.f32 s0, s0, s1
        assert_eq!(block(&[0xEE00, 0x0A20]).cycles, 3); // vmla.f32 s0, s0, s1
        assert_eq!(block(&[0xEE30, 0x0A20]).cycles, 1); // vadd.f32 s0, s0, s1
        assert_eq!(block(&[0xED2D, 0x8B10]).cycles, 17); // vpush {d8-d15}
        assert_eq!(block(&[0xF8D0, 0x1004]).cycles, 2); // ldr.w r1, [r0, #4]
    }

    #[test]
    fn special_instructions_are_seen() {
        assert!(block(&[0xE850, 0x1F00]).exclusive); // ldrex r1, [r0]
        assert!(block(&[0xBF40]).event); // sev
        assert!(block(&[0xEE30, 0x0A20]).float);
        assert_eq!(block(&[0xBF00]), Cost { instructions: 1, cycles: 1, ..Cost::default() });
    }
}
