//! Instructions that fault on silicon where the CPU library carries them out: multiple and double loads and stores, exclusive
//! and floating-point ones at an unaligned address, and a division by zero while that is trapped (ARMv7-M, A3.2.1 and B3.2.8).

use crate::scb::cfsr;

/// The status bits of the fault that an instruction raises, if any. `register` reads a core register by its number.
pub(crate) fn fault(code: &[u8], traps_division: bool, register: impl Fn(u16) -> u32) -> Option<u32> {
    let mut halves = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let (first, second) = (halves.next()?, halves.next().unwrap_or(0));
    if first & 0xFFD0 == 0xFB90 {
        let by_zero = traps_division && register(second & 0xF) == 0;
        return by_zero.then_some(cfsr::DIVBYZERO);
    }
    let (base, mask) = aligned_base(first, second)?;
    // PC as a base is aligned by the architecture.
    (base != 15 && register(base) & mask != 0).then_some(cfsr::UNALIGNED)
}

/// The base register of an access that must be aligned, and the bits of it that must be zero: offsets are multiples of four.
fn aligned_base(first: u16, second: u16) -> Option<(u16, u32)> {
    let wide = first & 0xF;
    let coprocessor = second >> 9 & 7 == 0b101;
    match first {
        // LDM and STM.
        0xC000..=0xCFFF => Some((first >> 8 & 7, 3)),
        // LDREXB, STREXB and the table branches need none; LDREXH and STREXH do.
        0xE8C0..=0xE8DF => (second >> 4 & 0xF == 5).then_some((wide, 1)),
        // LDM, STM, LDRD, STRD, LDREX and STREX.
        0xE800..=0xE9FF => Some((wide, 3)),
        // Two core registers to or from the FPU: no memory.
        0xEC40..=0xEC5F => None,
        // VLDR, VSTR, VLDM and VSTM.
        0xEC00..=0xEDFF if coprocessor => Some((wide, 3)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What an instruction does when every register holds this.
    fn with(value: u32, op: u32) -> Option<u32> {
        let halves = if op > 0xFFFF { vec![op >> 16, op & 0xFFFF] } else { vec![op] };
        let code: Vec<u8> = halves.iter().flat_map(|&half| (half as u16).to_le_bytes()).collect();
        fault(&code, true, |_| value)
    }

    #[test]
    fn accesses_that_must_be_aligned() {
        for (op, name) in [
            (0xE9D0_0100, "ldrd r0, r1, [r0]"),
            (0xE9C1_2302, "strd r2, r3, [r1, #8]"),
            (0xC806, "ldm r0, {r1, r2}"),
            (0xE890_0006, "ldm.w r0, {r1, r2}"),
            (0xED90_0A01, "vldr s0, [r0, #4]"),
            (0xEC90_0A03, "vldmia r0, {s0-s2}"),
            (0xE850_1F00, "ldrex r1, [r0]"),
        ] {
            assert_eq!(with(0x2000_0002, op), Some(cfsr::UNALIGNED), "{name}");
            assert_eq!(with(0x2000_0004, op), None, "{name}");
        }
        assert_eq!(with(0x2000_0001, 0xE8D0_1F5F), Some(cfsr::UNALIGNED), "ldrexh r1, [r0]");
        assert_eq!(with(0x2000_0002, 0xE8D0_1F5F), None, "ldrexh r1, [r0]");
    }

    #[test]
    fn accesses_that_need_not_be() {
        for (op, name) in [
            (0x6801, "ldr r1, [r0]"),
            (0xF8D0_1000, "ldr.w r1, [r0]"),
            (0xE8D0_1F4F, "ldrexb r1, [r0]"),
            (0xEC51_0B10, "vmov r0, r1, d0"),
            (0xEE30_0A20, "vadd.f32 s0, s0, s1"),
        ] {
            assert_eq!(with(0x2000_0003, op), None, "{name}");
        }
    }

    #[test]
    fn a_division_by_zero() {
        assert_eq!(with(0, 0xFBB0_F0F1), Some(cfsr::DIVBYZERO), "udiv r0, r0, r1");
        assert_eq!(with(1, 0xFBB0_F0F1), None);
    }
}
