//! The cost of a block of code in cycles of a Cortex-M4, without waits for buses and flash (technical reference manual,
//! table 3-1). The refill of the pipeline after a jump is counted at the begin of the next block.

use crate::engine::RAM;
use crate::estimate::Estimate;
use crate::floats;

/// Instructions and cycles of a block that runs to its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cost {
    pub(crate) instructions: u16,
    pub(crate) cycles: u16,
    /// Special features of the block, from [`EXCLUSIVE`], [`FLOATS`] and [`BASEPRI`]: most blocks have none.
    pub(crate) uses: u16,
}

/// An exclusive access begins in the block: LDREX, LDREXB or LDREXH.
pub(crate) const EXCLUSIVE: u16 = 1;
/// The block uses the floating-point unit.
pub(crate) const FLOATS: u16 = 2;
/// The block writes BASEPRI.
pub(crate) const BASEPRI: u16 = 4;

/// The costs of blocks that have already run.
#[derive(Clone, Debug)]
pub(crate) struct Costs {
    pub(crate) estimate: Estimate,
    /// One entry for each address modulo the size of the table.
    known: Box<[Known; PLACES]>,
    /// Pages with the begin of a known block.
    pages: Vec<u32>,
}

const PLACES: usize = 1 << 14;
/// Size in bytes. A block ends at the end of its page; only its last instruction may cross that border.
const PAGE: u32 = 1 << 12;

#[derive(Clone, Copy, Debug, Default)]
struct Known {
    address: u32,
    size: u16,
    cost: Cost,
}

impl Costs {
    pub(crate) fn new(estimate: Estimate) -> Costs {
        Costs { estimate, known: Box::new([Known::default(); PLACES]), pages: Vec::new() }
    }

    /// The cost of a block, if known.
    #[inline]
    pub(crate) fn get(&self, address: u32, size: u32) -> Option<&Cost> {
        let known = &self.known[place(address)];
        (known.address == address && u32::from(known.size) == size).then_some(&known.cost)
    }

    /// Computes the cost of a block and stores it.
    pub(crate) fn learn(&mut self, address: u32, code: &[u8]) -> Cost {
        let cost = of_block(code, self.estimate, address >= RAM);
        self.known[place(address)] = Known { address, size: code.len() as u16, cost };
        let page = address / PAGE;
        if !self.pages.contains(&page) {
            self.pages.push(page);
        }
        cost
    }

    /// Forgets the costs of changed code. Most writes to flash do not change code that has run.
    pub(crate) fn forget(&mut self, start: u32, end: u32) {
        const LONGEST_INSTRUCTION: u32 = 4;
        let changed = start.saturating_sub(LONGEST_INSTRUCTION) / PAGE..end.div_ceil(PAGE);
        for page in changed {
            if let Some(index) = self.pages.iter().position(|known| *known == page) {
                self.pages.swap_remove(index);
                let first = page * PAGE;
                (first..first + PAGE)
                    .step_by(2)
                    .for_each(|address| self.known[place(address)] = Known::default());
            }
        }
    }
}

#[inline]
fn place(address: u32) -> usize {
    (address >> 1) as usize % PLACES
}

/// Adds up the Thumb instructions in `code`. Code in RAM shares a bus with the data in RAM: in the worst case, each
/// word waits.
fn of_block(code: &[u8], estimate: Estimate, in_ram: bool) -> Cost {
    let mut halves = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut cost = Cost::default();
    let mut cycles = if in_ram { estimate.of(0, 0, code.len().div_ceil(4) as u32) } else { 0 };
    let mut result = None;
    while let Some(first) = halves.next() {
        cost.instructions += 1;
        let wide_second = (first >> 11 >= 0b11101).then(|| halves.next().unwrap_or(0));
        cycles += match wide_second {
            Some(second) if floats::is_floating(first, second) => {
                cost.uses |= FLOATS;
                let waits = result.is_some_and(|register| floats::reads(first, second, register));
                result = floats::result(first, second);
                floats::cycles(first, second) + u32::from(waits)
            }
            Some(second) => {
                cost.uses |= if begins_exclusive(first, second) { EXCLUSIVE } else { 0 };
                cost.uses |= if writes_basepri(first, second) { BASEPRI } else { 0 };
                result = None;
                wide(first, second, estimate)
            }
            None => {
                result = None;
                narrow(first, estimate)
            }
        };
    }
    // A block has some hundred instructions at most.
    Cost { cycles: cycles as u16, ..cost }
}

/// Whether the instruction is LDREX, LDREXB or LDREXH (ARMv7-M, A5.3.6).
fn begins_exclusive(first: u16, second: u16) -> bool {
    first & 0xFFF0 == 0xE850 || first & 0xFFF0 == 0xE8D0 && matches!(second >> 4 & 0xF, 0b0100 | 0b0101)
}

/// Whether the instruction is MSR to BASEPRI or BASEPRI_MAX (ARMv7-M, B5.2.3).
fn writes_basepri(first: u16, second: u16) -> bool {
    first & 0xFFE0 == 0xF380 && matches!(second & 0xFF, 0x11 | 0x12)
}

/// A load can directly follow another load; a store waits if the previous store is still in the buffer.
fn memory(load: bool, estimate: Estimate) -> u32 {
    if load { estimate.of(1, 2, 2) } else { estimate.of(1, 1, 2) }
}

/// Cycles of a 16-bit instruction.
fn narrow(op: u16, estimate: Estimate) -> u32 {
    match op >> 12 {
        // PC-relative load.
        0b0100 if op >> 11 == 0b01001 => memory(true, estimate),
        // Register offset: the upper half of the range loads.
        0b0101 => memory(op >> 9 & 7 >= 3, estimate),
        0b0110..=0b1001 => memory(op & 1 << 11 != 0, estimate),
        0b1011 => miscellaneous(op, estimate),
        // LDM and STM.
        0b1100 => 1 + (op & 0xFF).count_ones(),
        _ => 1,
    }
}

fn miscellaneous(op: u16, estimate: Estimate) -> u32 {
    match op >> 8 & 0xF {
        // PUSH and POP, with LR or PC.
        0b0100 | 0b0101 | 0b1100 | 0b1101 => 1 + (op & 0x1FF).count_ones(),
        // CPS.
        0b0110 => special(estimate),
        // IT can execute together with the previous instruction.
        0b1111 if op & 0xF != 0 => estimate.of(0, 1, 1),
        _ => 1,
    }
}

/// CPS, MRS and MSR.
fn special(estimate: Estimate) -> u32 {
    estimate.of(1, 1, 2)
}

/// Cycles of a 32-bit instruction outside the floating-point unit.
fn wide(first: u16, second: u16, estimate: Estimate) -> u32 {
    let load = first & 1 << 4 != 0;
    match (first >> 11 & 3, first >> 9 & 3) {
        // LDM and STM.
        (0b01, 0b00) if first & 1 << 6 == 0 => 1 + second.count_ones(),
        // Table branch.
        (0b01, 0b00) if first & 0xFFF0 == 0xE8D0 && second & 0xF0E0 == 0xF000 => 2,
        // LDRD, STRD, exclusive.
        (0b01, 0b00) => 3,
        // DSB, DMB and ISB.
        (0b10, _) if first == 0xF3BF && second >> 12 == 0b1000 => estimate.of(1, 1, 4),
        // MSR and MRS.
        (0b10, _) if matches!(first & 0xFFE0, 0xF380 | 0xF3E0) && second & 0xD000 == 0x8000 => {
            special(estimate)
        }
        (0b11, 0b00) if first & 0x0100 == 0 || first >> 8 == 0xF9 => memory(load, estimate),
        // SDIV and UDIV.
        (0b11, 0b01) if first & 0xFFD0 == 0xFB90 => estimate.of(2, 7, 12),
        _ => 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cycles of some instructions in flash, for each estimate: best, modelled and worst.
    fn cycles(ops: &[u32]) -> [u16; 3] {
        let halves =
            ops.iter().flat_map(|&op| if op > 0xFFFF { vec![op >> 16, op & 0xFFFF] } else { vec![op] });
        let code: Vec<u8> = halves.flat_map(|half| (half as u16).to_le_bytes()).collect();
        [Estimate::Best, Estimate::Modelled, Estimate::Worst].map(|estimate| {
            let cost = of_block(&code, estimate, false);
            assert_eq!(usize::from(cost.instructions), ops.len());
            cost.cycles
        })
    }

    #[test]
    fn instructions_take_the_cycles_of_the_manual() {
        for (op, cycles_of_it, name) in [
            (0x1C40, [1, 1, 1], "adds r0, r0, #1"),
            (0x6808, [1, 2, 2], "ldr r0, [r1]"),
            (0x4800, [1, 2, 2], "ldr r0, [pc]"),
            (0xF8D1_0000, [1, 2, 2], "ldr.w r0, [r1]"),
            (0x6008, [1, 1, 2], "str r0, [r1]"),
            (0xC806, [3, 3, 3], "ldm r0, {r1, r2}"),
            (0xB510, [3, 3, 3], "push {r4, lr}"),
            (0xBD10, [3, 3, 3], "pop {r4, pc}"),
            (0xE8BD_8010, [3, 3, 3], "pop.w {r4, pc}"),
            (0xE9D0_0100, [3, 3, 3], "ldrd r0, r1, [r0]"),
            (0xD0FE, [1, 1, 1], "beq"),
            (0xE7FE, [1, 1, 1], "b"),
            (0xF7FF_FFFE, [1, 1, 1], "bl"),
            (0xE8DF_F000, [2, 2, 2], "tbb [pc, r0]"),
            (0xFBB0_F0F1, [2, 7, 12], "udiv r0, r0, r1"),
            (0xFBA0_0102, [1, 1, 1], "umull r0, r1, r0, r2"),
            (0xBF08, [0, 1, 1], "it eq"),
            (0xBF00, [1, 1, 1], "nop"),
            (0xB672, [1, 1, 2], "cpsid i"),
            (0xF3EF_8011, [1, 1, 2], "mrs r0, basepri"),
            (0xF380_8811, [1, 1, 2], "msr basepri, r0"),
            (0xF3BF_8F6F, [1, 1, 4], "isb"),
            (0xF000_8000, [1, 1, 1], "beq.w"),
        ] {
            assert_eq!(cycles(&[op]), cycles_of_it, "{name}");
        }
    }

    #[test]
    fn a_block_shows_its_use_of_basepri_exclusives_and_floats() {
        let uses = |op: u32| {
            let code: Vec<u8> = [op >> 16, op].iter().flat_map(|half| (*half as u16).to_le_bytes()).collect();
            of_block(&code, Estimate::Modelled, false).uses
        };
        assert_eq!(uses(0xF380_8811), BASEPRI, "msr basepri, r0");
        assert_eq!(uses(0xF380_8812), BASEPRI, "msr basepri_max, r0");
        assert_eq!(uses(0xF380_8814), 0, "msr control, r0");
        assert_eq!(uses(0xE850_1F00), EXCLUSIVE, "ldrex r1, [r0]");
        assert_eq!(uses(0xEE30_0A20), FLOATS, "vadd.f32 s0, s0, s1");
    }

    #[test]
    fn a_result_of_the_fpu_is_waited_for_by_the_next_instruction_only() {
        let add = 0xEE30_0A20; // vadd.f32 s0, s0, s1
        assert_eq!(cycles(&[add, add])[1], 3);
        assert_eq!(cycles(&[add, 0xBF00, add])[1], 3);
        assert_eq!(cycles(&[add, 0xBF00])[1], 2);
    }

    #[test]
    fn code_in_ram_comes_over_the_bus_of_its_data() {
        let code = [0x08, 0x68, 0x08, 0x68]; // ldr r0, [r1], twice
        let cycles_of = |estimate| of_block(&code, estimate, true).cycles;
        assert_eq!([Estimate::Best, Estimate::Modelled, Estimate::Worst].map(cycles_of), [2, 4, 5]);
    }
}
