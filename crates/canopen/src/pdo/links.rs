//! Linked lists of PDOs, so that SYNC, reception and polling visit only the PDOs concerned, of up to 512.

/// A linked list of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Chain {
    /// All valid PDOs.
    Valid,
    /// The valid PDOs that a SYNC affects: RPDOs whose data waits for the SYNC, and TPDOs whose values are sent or
    /// sampled with the SYNC.
    Synchronous,
}

/// The positions of the next PDO in each chain, or of the first PDO of each chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Links {
    valid: u16,
    synchronous: u16,
}

impl Links {
    /// The position after the last PDO of a chain: no PDO has this position.
    const NOWHERE: u16 = u16::MAX;
    /// The end of both chains.
    pub(crate) const END: Links = Links { valid: Links::NOWHERE, synchronous: Links::NOWHERE };

    /// The position of the next PDO. At the end of the chain, no PDO has this position.
    #[inline]
    pub(crate) fn next(self, chain: Chain) -> usize {
        usize::from(match chain {
            Chain::Valid => self.valid,
            Chain::Synchronous => self.synchronous,
        })
    }

    /// Puts the PDO at position `place` before the others of the chain.
    pub(crate) fn prepend(&mut self, chain: Chain, place: usize) {
        let place = u16::try_from(place).unwrap_or(Links::NOWHERE);
        match chain {
            Chain::Valid => self.valid = place,
            Chain::Synchronous => self.synchronous = place,
        }
    }
}
