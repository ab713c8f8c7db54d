//! What a block of code costs in cycles of a Cortex-M4.
//!
//! Instructions are counted exactly; cycles are a model: no pipeline, no bus contention, flash wait states hidden by
//! the accelerator. Figures from the Cortex-M4 technical reference manual, table 3-1; the sum is good to about 30 %.

/// Instructions and cycles of a block, when it runs to its end.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Cost {
    pub(crate) instructions: u16,
    pub(crate) cycles: u16,
    /// What else the block does, from [`EXCLUSIVE`] and [`FLOATS`]: most do nothing of the kind.
    pub(crate) uses: u16,
}

/// An exclusive access begins in the block: LDREX, LDREXB or LDREXH.
pub(crate) const EXCLUSIVE: u16 = 1;
/// The block uses the floating-point unit.
pub(crate) const FLOATS: u16 = 2;

/// The costs of blocks that ran before.
#[derive(Clone, Debug)]
pub(crate) struct Costs {
    /// One place for each address modulo the size of the table.
    known: Box<[Known; PLACES]>,
    /// Pages in which a block begins that is known.
    pages: Vec<u32>,
}

const PLACES: usize = 1 << 14;
/// In bytes. No block goes on beyond its page, but for its last instruction.
const PAGE: u32 = 1 << 12;

#[derive(Clone, Copy, Debug, Default)]
struct Known {
    address: u32,
    size: u16,
    cost: Cost,
}

impl Default for Costs {
    fn default() -> Costs {
        Costs { known: Box::new([Known::default(); PLACES]), pages: Vec::new() }
    }
}

impl Costs {
    /// The cost of a block, when it is known.
    #[inline]
    pub(crate) fn get(&self, address: u32, size: u32) -> Option<&Cost> {
        let known = &self.known[place(address)];
        (known.address == address && u32::from(known.size) == size).then_some(&known.cost)
    }

    /// Computes the cost of a block and remembers it.
    pub(crate) fn learn(&mut self, address: u32, code: &[u8]) -> Cost {
        let cost = of_block(code);
        self.known[place(address)] = Known { address, size: code.len() as u16, cost };
        let page = address / PAGE;
        if !self.pages.contains(&page) {
            self.pages.push(page);
        }
        cost
    }

    /// Code has changed, up to `end`. Flash is written much more often than code that ran is.
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

/// Adds up the Thumb instructions in `code`.
fn of_block(code: &[u8]) -> Cost {
    let mut halves = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let mut cost = Cost::default();
    let mut cycles = 0;
    while let Some(first) = halves.next() {
        cost.instructions += 1;
        cycles += match first >> 11 {
            0b11101..=0b11111 => {
                let second = halves.next().unwrap_or(0);
                cost.uses |= if begins_exclusive(first, second) { EXCLUSIVE } else { 0 };
                cost.uses |= if is_floating(first, second) { FLOATS } else { 0 };
                wide(first, second)
            }
            _ => narrow(first),
        };
    }
    // A block has some hundred instructions at most.
    Cost { cycles: cycles as u16, ..cost }
}

/// An instruction of coprocessors 10 and 11.
fn is_floating(first: u16, second: u16) -> bool {
    first & 0xEC00 == 0xEC00 && second >> 9 & 7 == 0b101
}

/// LDREX, LDREXB or LDREXH (ARMv7-M, A5.3.6).
fn begins_exclusive(first: u16, second: u16) -> bool {
    first & 0xFFF0 == 0xE850 || first & 0xFFF0 == 0xE8D0 && matches!(second >> 4 & 0xF, 0b0100 | 0b0101)
}

/// A load takes two cycles, a store one.
fn memory(load: bool) -> u32 {
    1 + u32::from(load)
}

/// Cycles of a 16-bit instruction.
fn narrow(op: u16) -> u32 {
    match op >> 12 {
        // PC-relative load; BX and BLX refill the pipeline.
        0b0100 if op >> 11 == 0b01001 => 2,
        0b0100 if op >> 8 == 0b0100_0111 => 3,
        // Register offset: the upper half of the range loads.
        0b0101 => memory(op >> 9 & 7 >= 3),
        0b0110..=0b1001 => memory(op & 1 << 11 != 0),
        0b1011 => miscellaneous(op),
        // LDM and STM.
        0b1100 => 1 + (op & 0xFF).count_ones(),
        // Branches: taken more often than not.
        0b1101 => 2,
        0b1110 => 3,
        _ => 1,
    }
}

fn miscellaneous(op: u16) -> u32 {
    match op >> 8 & 0xF {
        0b0100 | 0b0101 => 1 + (op & 0x1FF).count_ones(),
        0b1100 => 1 + (op & 0xFF).count_ones(),
        0b1101 => 1 + (op & 0xFF).count_ones() + 3,
        // CBZ and CBNZ.
        0b0001 | 0b0011 | 0b1001 | 0b1011 => 2,
        _ => 1,
    }
}

/// Cycles of a 32-bit instruction.
fn wide(first: u16, second: u16) -> u32 {
    let load = first & 1 << 4 != 0;
    match (first >> 11 & 3, first >> 9 & 3) {
        // LDM, STM, LDRD, STRD, exclusive, table branch.
        (0b01, 0b00) if first & 1 << 6 == 0 => {
            1 + second.count_ones() + if second >> 15 == 1 && load { 3 } else { 0 }
        }
        (0b01, 0b00) if first & 0xFFF0 == 0xE8D0 && second & 0xF0E0 == 0xF000 => 4,
        (0b01, 0b00) => 3,
        // Floating point: loads and stores of registers, VDIV and VSQRT, VMLA.
        (0b01 | 0b11, 0b10 | 0b11) if second >> 9 & 7 == 0b101 => floating(first, second),
        // Branch with link, long branches.
        (0b10, _) if second >> 15 == 1 => 3,
        (0b11, 0b00) if first & 0x0100 == 0 || first >> 8 == 0xF9 => memory(load),
        // SDIV and UDIV.
        (0b11, 0b01) if first & 0xFFD0 == 0xFB90 => 7,
        _ => 1,
    }
}

/// The FPU (technical reference manual, table 7-1). Of an access to one register the low byte is an offset, of one to several
/// it is their number.
fn floating(first: u16, second: u16) -> u32 {
    let (up, down) = (first & 1 << 7 != 0, first & 1 << 5 != 0);
    match first >> 8 & 0xF {
        0b1101 if up => 2,
        0b1100 | 0b1101 if up || down => 1 + u32::from(second & 0xFF),
        // Two core registers at once.
        0b1100 => 2,
        // Between a core register and one of the FPU.
        0b1110 if second & 1 << 4 != 0 => 1,
        // VDIV, VSQRT, VMLA.
        0b1110 if first & 0x00B0 == 0x0080 => 14,
        0b1110 if first & 0x00BF == 0x00B1 && second & 0x00C0 == 0x00C0 => 14,
        0b1110 if first & 0x00B0 == 0x0000 => 3,
        0b1110 if first & 0x00B0 == 0x00A0 => 3,
        _ => 1,
    }
}

/// Cycles of exception entry, tail-chaining and exit (technical reference manual, 3.9).
pub(crate) const ENTRY: u32 = 12;
pub(crate) const TAIL_CHAIN: u32 = 6;
pub(crate) const EXIT: u32 = 12;

#[cfg(test)]
mod tests {
    use super::*;

    /// The cycles of one 32-bit instruction.
    fn cycles(op: u32) -> u32 {
        let code: Vec<u8> =
            [op >> 16, op & 0xFFFF].iter().flat_map(|half| (*half as u16).to_le_bytes()).collect();
        let cost = of_block(&code);
        assert_eq!(cost.instructions, 1);
        u32::from(cost.cycles)
    }

    #[test]
    fn instructions_of_the_fpu_take_what_the_manual_says() {
        for (op, cycles_of_it, name) in [
            (0xED90_0A32, 2, "vldr s0, [r0, #200]"),
            (0xED9F_0A10, 2, "vldr s0, [pc, #64]"),
            (0xED8D_0A05, 2, "vstr s0, [sp, #20]"),
            (0xED2D_8B04, 5, "vpush {d8-d9}"),
            (0xECBD_8B04, 5, "vpop {d8-d9}"),
            (0xEC90_0A03, 4, "vldmia r0, {s0-s2}"),
            (0xEE00_0A10, 1, "vmov s0, r0"),
            (0xEE10_0A10, 1, "vmov r0, s0"),
            (0xEE30_0A20, 1, "vadd.f32 s0, s0, s1"),
            (0xEE20_0A20, 1, "vmul.f32 s0, s0, s1"),
            (0xEE80_0A20, 14, "vdiv.f32 s0, s0, s1"),
            (0xEEB1_0AC0, 14, "vsqrt.f32 s0, s0"),
            (0xEEB1_0A40, 1, "vneg.f32 s0, s0"),
            (0xEEB4_0A60, 1, "vcmp.f32 s0, s1"),
            (0xEEB8_0A40, 1, "vcvt.f32.u32 s0, s0"),
            (0xEEF1_FA10, 1, "vmrs apsr, fpscr"),
            (0xEE00_0A20, 3, "vmla.f32 s0, s0, s1"),
            (0xEEA0_0A20, 3, "vfma.f32 s0, s0, s1"),
        ] {
            assert_eq!(cycles(op), cycles_of_it, "{name}");
        }
    }
}
