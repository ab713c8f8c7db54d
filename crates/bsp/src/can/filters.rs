//! Assignment of identifiers to the receive FIFOs, packed into the filter banks of bxCAN (RM0390, 30.7.4).
//!
//! A bank holds two pairs of identifier and mask with 16 bits each. A pair accepts both the data frame and the remote
//! frame of an identifier, which an entry of an identifier list does not. A frame that no bank accepts never reaches
//! the core.

use heapless::Vec;

/// Number of banks for CAN1 if CAN2 has none.
pub const BANKS: usize = 28;

/// Destination of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fifo {
    /// FIFO 0: NMT, SYNC and RPDO.
    Process,
    /// FIFO 1: all other frames.
    Services,
}

/// One pair of a bank: a frame passes if `(its identifier ^ id) & mask == 0`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pair {
    /// Identifier, 11 bits.
    pub id: u16,
    /// Mask of the bits that must agree.
    pub mask: u16,
}

impl Pair {
    const ANY: Pair = Pair { id: 0, mask: 0 };

    /// A pair for one identifier, data and remote frames.
    #[must_use]
    pub const fn exactly(id: u16) -> Pair {
        Pair { id: id & 0x7FF, mask: 0x7FF }
    }

    /// The register of a bank with 16-bit masks: the identifier below the mask. IDE is compared, so that extended
    /// frames do not pass; RTR is not (RM0390, 30.7.4).
    #[must_use]
    pub fn register(self) -> u32 {
        const IDE: u32 = 1 << 3;
        (u32::from(self.mask) << 5 | IDE) << 16 | u32::from(self.id) << 5
    }
}

/// One filter bank.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bank {
    /// Destination of the frames.
    pub fifo: Fifo,
    /// A frame that agrees with either pair passes.
    pub pairs: [Pair; 2],
}

/// The banks in order. If two banks accept a frame, the first decides (RM0390, 30.7.4, filter priority rules).
pub type Banks = Vec<Bank, BANKS>;

/// Packs identifiers into banks; identifiers of process data come with a mask of the bits to compare. If they do not
/// fit, the last bank passes every base frame to FIFO 1 and the protocol sorts the frames out, so no frame is lost.
/// Process data always fit: see the assertion.
pub fn pack(process: impl Iterator<Item = (u16, u16)>, services: impl Iterator<Item = u16>) -> Banks {
    let mut banks = Banks::new();
    let process = process.map(|(id, mask)| Pair { id, mask });
    let has_process = fill(&mut banks, Fifo::Process, process) && !banks.is_full();
    debug_assert!(has_process, "the process data leave no bank for the services");
    let complete = has_process && fill(&mut banks, Fifo::Services, services.map(Pair::exactly));
    if !complete {
        banks.pop();
        let _ = banks.push(EVERYTHING);
    }
    banks
}

/// A single bank that passes every base frame to FIFO 1.
#[must_use]
pub fn everything() -> Banks {
    Banks::from_iter([EVERYTHING])
}

const EVERYTHING: Bank = Bank { fifo: Fifo::Services, pairs: [Pair::ANY; 2] };

/// Adds banks for `pairs`; false if no bank is left.
fn fill(banks: &mut Banks, fifo: Fifo, mut pairs: impl Iterator<Item = Pair>) -> bool {
    while let Some(first) = pairs.next() {
        let pairs = [first, pairs.next().unwrap_or(first)];
        if banks.push(Bank { fifo, pairs }).is_err() {
            return false;
        }
    }
    true
}

#[cfg(test)]
mod tests {
    use super::*;

    fn exactly(ids: impl IntoIterator<Item = u16>) -> impl Iterator<Item = (u16, u16)> {
        ids.into_iter().map(|id| (id, 0x7FF))
    }

    /// The FIFO into which the hardware puts a frame, by the rules of the hardware.
    fn route(banks: &Banks, id: u16) -> Option<Fifo> {
        let passes = |pair: &Pair| (id ^ pair.id) & pair.mask == 0;
        banks.iter().find(|bank| bank.pairs.iter().any(passes)).map(|bank| bank.fifo)
    }

    #[test]
    fn each_identifier_reaches_its_fifo_and_no_other_passes() {
        let process = [0x000, 0x080, 0x201];
        let services = [0x601, 0x7E5];
        let banks = pack(exactly(process), services.into_iter());
        for id in 0..=0x7FF {
            let wanted = match id {
                id if process.contains(&id) => Some(Fifo::Process),
                id if services.contains(&id) => Some(Fifo::Services),
                _ => None,
            };
            assert_eq!(route(&banks, id), wanted, "{id:#x}");
        }
    }

    #[test]
    fn a_service_of_all_nodes_is_one_pair() {
        let banks = pack(exactly([0x000, 0x400]).chain([(0x501, 0x780)]), [0x601].into_iter());
        assert!((0x501..=0x57F).chain([0x000, 0x400]).all(|id| route(&banks, id) == Some(Fifo::Process)));
        assert_eq!([0x601, 0x481, 0x580].map(|id| route(&banks, id)), [Some(Fifo::Services), None, None]);
        assert_eq!(banks.len(), 3);
    }

    #[test]
    fn an_identifier_in_both_lists_is_process_data() {
        let banks = pack(exactly([0x200]), [0x200].into_iter());
        assert_eq!(route(&banks, 0x200), Some(Fifo::Process));
    }

    #[test]
    fn all_banks_can_be_used() {
        let banks = pack(exactly(0..4), 0x700..0x700 + 52);
        assert_eq!(banks.len(), BANKS);
        assert_eq!(route(&banks, 0x700 + 51), Some(Fifo::Services));
        assert_eq!(route(&banks, 0x700 + 52), None);
    }

    #[test]
    fn with_too_many_identifiers_none_is_lost() {
        let banks = pack(exactly(0..4), 0x700..0x700 + 54);
        assert_eq!(banks.len(), BANKS);
        assert!((0..4).all(|id| route(&banks, id) == Some(Fifo::Process)));
        assert!((0x700..0x700 + 54).all(|id| route(&banks, id) == Some(Fifo::Services)));
    }

    #[test]
    fn no_identifiers_need_no_bank() {
        assert!(pack(exactly([]), [].into_iter()).is_empty());
    }
}
