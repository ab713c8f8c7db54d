//! Which faults are tried at a point.

use emulator::Flag;
use fastrand::Rng;

use crate::fault::Fault;
use crate::reads::Reads;

/// Bits of a register.
const BITS: usize = 32;

/// Each flag where flags are read.
pub(crate) fn flags(reads: &Reads) -> Vec<Fault> {
    let at = reads.at;
    if reads.flags { Flag::ALL.map(|flag| Fault::Flag { at, flag }).to_vec() } else { Vec::new() }
}

/// Bits of the registers that are read.
pub(crate) fn possible(reads: &Reads) -> usize {
    reads.registers.len() * BITS
}

/// So many of these bits, each of them at most once: those of a point are the same in every run.
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
    fn what_is_not_read_is_left_alone() {
        assert_eq!(flags(&reads(&[1], false)), []);
        assert_eq!(flags(&reads(&[], true)).len(), 4);
        let bits = some_bits(&reads(&[1, 13], false), 1, 20);
        assert_eq!(bits.len(), 20);
        assert!(bits.iter().all(|fault| matches!(fault, Fault::Flip { register: 1 | 13, bit: 0..32, .. })));
        assert_eq!(some_bits(&reads(&[], true), 1, 20), []);
    }

    #[test]
    fn where_more_are_wanted_than_there_are_each_bit_is_tried_once() {
        let mut bits = some_bits(&reads(&[0, 2, 3], false), 1, 1000);
        assert_eq!(bits.len(), possible(&reads(&[0, 2, 3], false)));
        bits.sort_by_key(|fault| format!("{fault}"));
        bits.dedup();
        assert_eq!(bits.len(), 96);
    }

    #[test]
    fn a_seed_of_the_point_decides() {
        let some = |visit| some_bits(&reads(&[0, 2, 3], false), visit, 8);
        assert_eq!(some(1), some(1));
        assert_ne!(some(1), some(2));
    }
}
