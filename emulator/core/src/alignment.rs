//! Faults that silicon raises and the CPU library does not. Multiple, double, exclusive and floating-point loads and
//! stores fault at an unaligned address. With traps enabled, any access to an unaligned word or halfword faults, and so
//! does a division by zero (ARMv7-M, A3.2.1 and B3.2.8).

use crate::scb::{DIV_0_TRP, UNALIGN_TRP, cfsr};

/// The status bits of the fault that an instruction raises, if any. `register` reads a core register by its number.
pub(crate) fn fault(code: &[u8], ccr: u32, register: impl Fn(u16) -> u32) -> Option<u32> {
    let mut halves = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let (first, second) = (halves.next()?, halves.next().unwrap_or(0));
    if first & 0xFFD0 == 0xFB90 {
        let by_zero = ccr & DIV_0_TRP != 0 && register(second & 0xF) == 0;
        return by_zero.then_some(cfsr::DIVBYZERO);
    }
    let is_unaligned = match aligned_base(first, second) {
        // The architecture aligns PC when PC is the base.
        Some((base, mask)) => base != 15 && register(base) & mask != 0,
        None if ccr & UNALIGN_TRP != 0 => {
            single(first, second, register).is_some_and(|(address, mask)| address & mask != 0)
        }
        None => false,
    };
    is_unaligned.then_some(cfsr::UNALIGNED)
}

/// The address of a data access, as far as the instruction names it: the first one of several, without an offset.
pub(crate) fn accessed(code: &[u8], register: impl Fn(u16) -> u32) -> Option<u32> {
    let mut halves = code.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]));
    let (first, second) = (halves.next()?, halves.next().unwrap_or(0));
    match aligned_base(first, second) {
        Some((base, _)) => Some(register(base)),
        None => single(first, second, register).map(|(address, _)| address),
    }
}

/// The address of a load or store of one word or halfword, and the address bits that must be zero for an aligned
/// access.
fn single(first: u16, second: u16, register: impl Fn(u16) -> u32) -> Option<(u32, u32)> {
    const WORD: u32 = 3;
    const HALFWORD: u32 = 1;
    let from = |base: u16, offset: u32| register(base).wrapping_add(offset);
    let (base, immediate) = (first >> 3 & 7, u32::from(first >> 6 & 31));
    match first {
        0x5000..=0x5FFF => {
            let mask = match first >> 9 & 7 {
                0 | 4 => WORD,
                1 | 5 | 7 => HALFWORD,
                _ => return None,
            };
            Some((from(base, register(first >> 6 & 7)), mask))
        }
        0x6000..=0x6FFF => Some((from(base, immediate * 4), WORD)),
        0x8000..=0x8FFF => Some((from(base, immediate * 2), HALFWORD)),
        0x9000..=0x9FFF => Some((from(13, u32::from(first & 0xFF) * 4), WORD)),
        // A load relative to PC reads a literal, which the assembler aligns.
        0xF800..=0xF9FF if first & 0xF != 15 => {
            let mask = match first >> 5 & 3 {
                1 => HALFWORD,
                2 => WORD,
                _ => return None,
            };
            Some((from(first & 0xF, offset(first, second, &register)), mask))
        }
        _ => None,
    }
}

/// The offset of a load or store of 32 bits (ARMv7-M, A5.3.7 to A5.3.10), which may be negative.
fn offset(first: u16, second: u16, register: &impl Fn(u16) -> u32) -> u32 {
    let (is_long, is_immediate) = (first & 1 << 7 != 0, second & 1 << 11 != 0);
    let (before, up) = (second & 1 << 10 != 0, second & 1 << 9 != 0);
    let byte = u32::from(second & 0xFF);
    match (is_long, is_immediate) {
        (true, _) => u32::from(second & 0xFFF),
        (false, false) => register(second & 0xF) << (second >> 4 & 3),
        (false, true) if !before => 0,
        (false, true) if up => byte,
        (false, true) => byte.wrapping_neg(),
    }
}

/// The base register of an access that must be aligned, and the register's bits that must be zero; all offsets are
/// multiples of four.
fn aligned_base(first: u16, second: u16) -> Option<(u16, u32)> {
    let wide = first & 0xF;
    let coprocessor = second >> 9 & 7 == 0b101;
    match first {
        // LDM and STM.
        0xC000..=0xCFFF => Some((first >> 8 & 7, 3)),
        // LDREXB, STREXB and the table branches need no alignment; LDREXH and STREXH do.
        0xE8C0..=0xE8DF => (second >> 4 & 0xF == 5).then_some((wide, 1)),
        // LDM, STM, LDRD, STRD, LDREX and STREX.
        0xE800..=0xE9FF => Some((wide, 3)),
        // A transfer between two core registers and the FPU does not access memory.
        0xEC40..=0xEC5F => None,
        // VLDR, VSTR, VLDM and VSTM.
        0xEC00..=0xEDFF if coprocessor => Some((wide, 3)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The fault of an instruction when every register holds `value`.
    fn with_traps(ccr: u32, value: u32, op: u32) -> Option<u32> {
        let halves = if op > 0xFFFF { vec![op >> 16, op & 0xFFFF] } else { vec![op] };
        let code: Vec<u8> = halves.iter().flat_map(|&half| (half as u16).to_le_bytes()).collect();
        fault(&code, DIV_0_TRP | ccr, |_| value)
    }

    fn with(value: u32, op: u32) -> Option<u32> {
        with_traps(0, value, op)
    }

    #[test]
    fn any_access_while_that_is_trapped() {
        for (op, aligned, unaligned, name) in [
            (0x6801, 4, 6, "ldr r1, [r0]"),
            (0x6041, 4, 1, "str r1, [r0, #4]"),
            (0x5888, 2, 3, "ldr r0, [r1, r2]"),
            (0x8801, 2, 1, "ldrh r1, [r0]"),
            (0x8041, 6, 3, "strh r1, [r0, #2]"),
            (0x9801, 4, 2, "ldr r0, [sp, #4]"),
            (0xF8D0_1002, 2, 4, "ldr.w r1, [r0, #2]"),
            (0xF850_1C02, 2, 4, "ldr.w r1, [r0, #-2]"),
            (0xF850_1B02, 4, 2, "ldr.w r1, [r0], #2"),
            (0xF850_1F02, 2, 4, "ldr.w r1, [r0, #2]!"),
            (0xF8A0_1001, 1, 2, "strh.w r1, [r0, #1]"),
            (0xF850_1022, 4, 3, "ldr.w r1, [r0, r2, lsl #2]"),
        ] {
            assert_eq!(with_traps(UNALIGN_TRP, aligned, op), None, "{name}");
            assert_eq!(with_traps(UNALIGN_TRP, unaligned, op), Some(cfsr::UNALIGNED), "{name}");
            assert_eq!(with(unaligned, op), None, "{name}");
        }
        for (op, name) in [(0x7801, "ldrb r1, [r0]"), (0xF890_1001, "ldrb.w r1, [r0, #1]"), (0x1C40, "adds")]
        {
            assert_eq!(with_traps(UNALIGN_TRP, 3, op), None, "{name}");
        }
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
