//! The floating-point unit: cycles of its instructions (Cortex-M4 technical reference manual, table 7-1), and
//! instructions that wait for the result of the previous one.

/// Whether the instruction belongs to coprocessors 10 and 11.
pub(crate) fn is_floating(first: u16, second: u16) -> bool {
    first & 0xEC00 == 0xEC00 && second >> 9 & 7 == 0b101
}

/// Cycles of the instruction. The low byte of a load or store is an offset for one register, and the number of
/// registers for several.
pub(crate) fn cycles(first: u16, second: u16) -> u32 {
    let (up, down) = (first & 1 << 7 != 0, first & 1 << 5 != 0);
    match first >> 8 & 0xF {
        0b1101 if up => 2,
        0b1100 | 0b1101 if up || down => 1 + u32::from(second & 0xFF),
        // A transfer of two core registers.
        0b1100 => 2,
        // A transfer between a core register and one of the FPU.
        0b1110 if is_transfer(second) => 1,
        // VDIV, VSQRT, VMLA.
        0b1110 if first & 0x00B0 == 0x0080 => 14,
        0b1110 if is_square_root(first, second) => 14,
        0b1110 if first & 0x00B0 == 0x0000 => 3,
        0b1110 if first & 0x00B0 == 0x00A0 => 3,
        _ => 1,
    }
}

/// The result register of an arithmetic instruction. The next instruction waits one cycle for this register.
pub(crate) fn result(first: u16, second: u16) -> Option<u16> {
    let is_arithmetic = match (first >> 8 & 0xF, has_one_operand(first)) {
        (0b1110, _) if is_transfer(second) => false,
        (0b1110, false) => true,
        // VSQRT and conversions, but not moves, sign changes or comparisons.
        (0b1110, true) => is_square_root(first, second) || matches!(first & 0xF, 2 | 3 | 7..),
        _ => false,
    };
    is_arithmetic.then(|| destination(first, second))
}

/// Whether an instruction reads a register of the unit.
pub(crate) fn reads(first: u16, second: u16, register: u16) -> bool {
    let n = (first & 0xF) << 1 | second >> 7 & 1;
    let m = (second & 0xF) << 1 | second >> 5 & 1;
    let d = destination(first, second);
    match first >> 8 & 0xF {
        // VMOV to a core register.
        0b1110 if is_transfer(second) => first & 1 << 4 != 0 && register == n,
        0b1110 if has_one_operand(first) => register == m || matches!(first & 0xF, 4 | 5) && register == d,
        // VADD, VSUB, VMUL, VDIV; an instruction that accumulates into its destination also reads the destination.
        0b1110 => register == n || register == m || cycles(first, second) == 3 && register == d,
        // VSTR of one register.
        0b1101 if first & 1 << 4 == 0 => register == d,
        _ => false,
    }
}

/// Sd.
fn destination(first: u16, second: u16) -> u16 {
    (second >> 12 & 0xF) << 1 | first >> 6 & 1
}

fn is_transfer(second: u16) -> bool {
    second & 1 << 4 != 0
}

fn has_one_operand(first: u16) -> bool {
    first & 0x00B0 == 0x00B0
}

fn is_square_root(first: u16, second: u16) -> bool {
    first & 0x00BF == 0x00B1 && second & 0x00C0 == 0x00C0
}

#[cfg(test)]
mod tests {
    use super::*;

    fn halves(op: u32) -> (u16, u16) {
        ((op >> 16) as u16, op as u16)
    }

    #[test]
    fn instructions_take_the_cycles_of_the_manual() {
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
            let (first, second) = halves(op);
            assert!(is_floating(first, second), "{name}");
            assert_eq!(cycles(first, second), cycles_of_it, "{name}");
        }
    }

    #[test]
    fn an_instruction_names_the_float_registers_that_it_reads_and_leaves() {
        for (op, left, read, name) in [
            (0xEE30_0A20, Some(0), &[0, 1][..], "vadd.f32 s0, s0, s1"),
            (0xEE71_1A03, Some(3), &[2, 6], "vadd.f32 s3, s2, s6"),
            (0xEE00_0A81, Some(0), &[0, 1, 2], "vmla.f32 s0, s1, s2"),
            (0xEEB1_0AE0, Some(0), &[1], "vsqrt.f32 s0, s1"),
            (0xEEB8_0A60, Some(0), &[1], "vcvt.f32.u32 s0, s1"),
            (0xEEB1_0A60, None, &[1], "vneg.f32 s0, s1"),
            (0xEEB0_0A60, None, &[1], "vmov.f32 s0, s1"),
            (0xEEB4_0A60, None, &[0, 1], "vcmp.f32 s0, s1"),
            (0xEE10_0A90, None, &[1], "vmov r0, s1"),
            (0xEE00_0A90, None, &[], "vmov s1, r0"),
            (0xEDCD_0A01, None, &[1], "vstr s1, [sp, #4]"),
            (0xEDDD_0A01, None, &[], "vldr s1, [sp, #4]"),
        ] {
            let (first, second) = halves(op);
            assert_eq!(result(first, second), left, "{name}");
            let all: Vec<u16> = (0..32).filter(|&register| reads(first, second, register)).collect();
            assert_eq!(all, read, "{name}");
        }
    }
}
