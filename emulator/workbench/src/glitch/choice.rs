//! Selection of the faults at a point.

use emulator::Flag;
use fastrand::Rng;

use crate::glitch::fault::Fault;
use crate::glitch::reads::Reads;

/// Number of bits in a register.
const BITS: usize = 32;

/// A fault for each flag if the instruction reads flags.
pub(crate) fn flags(reads: &Reads) -> Vec<Fault> {
    let at = reads.at;
    if reads.flags { Flag::ALL.map(|flag| Fault::Flag { at, flag }).to_vec() } else { Vec::new() }
}

/// Number of bits in the registers that the instruction reads.
pub(crate) fn possible(reads: &Reads) -> usize {
    reads.registers.len() * BITS
}

/// A sample of these bits without repetition. A point has the same sample in every run.
pub(crate) fn some_bits(reads: &Reads, visit: u64, count: usize) -> Vec<Fault> {
    let at = reads.at;
    let all = reads
        .registers
        .iter()
        .flat_map(|&register| (0..BITS as u8).map(move |bit| Fault::Flip { at, register, bit }));
    Rng::with_seed(u64::from(at) << 32 ^ visit).choose_multiple(all, count)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reads(registers: &[u8], flags: bool) -> Reads {
        Reads { at: 0x2000_1000, registers: registers.iter().copied().collect(), flags }
    }

    #[test]
    fn flags_and_registers_that_are_not_read_are_not_changed() {
        assert_eq!(flags(&reads(&[1], false)), []);
        assert_eq!(flags(&reads(&[], true)).len(), 4);
        let bits = some_bits(&reads(&[1, 13], false), 1, 20);
        assert_eq!(bits.len(), 20);
        assert!(bits.iter().all(|fault| matches!(fault, Fault::Flip { register: 1 | 13, bit: 0..32, .. })));
        assert_eq!(some_bits(&reads(&[], true), 1, 20), []);
    }

    #[test]
    fn each_bit_is_flipped_once_if_the_sample_is_larger_than_the_registers() {
        let mut bits = some_bits(&reads(&[0, 2, 3], false), 1, 1000);
        assert_eq!(bits.len(), possible(&reads(&[0, 2, 3], false)));
        bits.sort_by_key(|fault| format!("{fault}"));
        bits.dedup();
        assert_eq!(bits.len(), 96);
    }

    #[test]
    fn the_sample_is_the_same_for_a_point_and_differs_between_points() {
        let some = |visit| some_bits(&reads(&[0, 2, 3], false), visit, 8);
        assert_eq!(some(1), some(1));
        assert_ne!(some(1), some(2));
    }
}
