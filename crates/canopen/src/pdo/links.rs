//! Chains of PDOs: the hot paths visit the PDOs that concern them and no others, be there eight or 512.

/// A chain of PDOs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Chain {
    /// All that are valid.
    Valid,
    /// The valid PDOs that the SYNC concerns: RPDOs whose data waits for the SYNC, and TPDOs whose values the SYNC sends or
    /// samples.
    Synchronous,
}

/// The places of the PDOs that follow in each chain, or that begin the chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Links {
    valid: u16,
    synchronous: u16,
}

impl Links {
    /// The place after the last of a chain: no PDO is there.
    const NOWHERE: u16 = u16::MAX;
    /// The end of both chains.
    pub(crate) const END: Links = Links { valid: Links::NOWHERE, synchronous: Links::NOWHERE };

    /// The place of the next PDO. There is none at the end.
    #[inline]
    pub(crate) fn next(self, chain: Chain) -> usize {
        usize::from(match chain {
            Chain::Valid => self.valid,
            Chain::Synchronous => self.synchronous,
        })
    }

    /// Puts the PDO at a place before all others.
    pub(crate) fn prepend(&mut self, chain: Chain, place: usize) {
        let place = u16::try_from(place).unwrap_or(Links::NOWHERE);
        match chain {
            Chain::Valid => self.valid = place,
            Chain::Synchronous => self.synchronous = place,
        }
    }
}
