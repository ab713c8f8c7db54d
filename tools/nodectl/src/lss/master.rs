//! The services of the master.

use canopen::client::Service;
use canopen::client::lss::{self, Fastscan, Options};
use canopen::lss::{BitRate, Identity, Part};
use canopen::{Duration, NodeId};

use super::Error;
use crate::Network;

/// The slaves that the services are for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Selection {
    /// All on the bus. What they answer is of use only where there is one.
    All,
    /// The one with this identity.
    One(Identity),
}

/// The LSS master.
pub struct Master<'n> {
    network: &'n mut Network,
    options: Options,
}

impl<'n> Master<'n> {
    /// A master that waits this long for answers, and asks again as often as is usual.
    pub fn new(network: &'n mut Network, timeout: Duration) -> Master<'n> {
        Master { network, options: Options { timeout, ..Options::default() } }
    }

    /// Brings slaves into the state configuration.
    ///
    /// # Errors
    /// No slave has this identity, or the bus is lost. All slaves together do not answer.
    pub fn select(&mut self, selection: Selection) -> Result<(), Error> {
        self.release()?;
        match selection {
            Selection::All => Ok(self.network.send(&lss::switch_global(true))?),
            Selection::One(identity) => self.run(lss::select(&identity, self.options)),
        }
    }

    /// Brings all slaves back into the state waiting. Those that have got a node-ID boot with it.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn release(&mut self) -> Result<(), Error> {
        Ok(self.network.send(&lss::switch_global(false))?)
    }

    /// The identity of the selected slave.
    ///
    /// # Errors
    /// No answer, or the bus is lost.
    pub fn identity(&mut self) -> Result<Identity, Error> {
        let mut words = [0; 4];
        for (word, asked) in words.iter_mut().zip(Part::ALL) {
            *word = self.run(lss::inquire(asked, self.options))?;
        }
        let [vendor, product, revision, serial] = words;
        Ok(Identity { vendor, product, revision, serial })
    }

    /// The node-ID of the selected slave; `None` when it has none.
    ///
    /// # Errors
    /// No answer, or the bus is lost.
    pub fn node_id(&mut self) -> Result<Option<NodeId>, Error> {
        self.run(lss::inquire_node_id(self.options))
    }

    /// Gives the selected slave a node-ID, or takes it away.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn set_node_id(&mut self, node_id: Option<NodeId>) -> Result<(), Error> {
        self.run(lss::set_node_id(node_id, self.options))
    }

    /// Gives the selected slave a bit rate, for [`activate`](Master::activate) or its next start.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn set_bit_rate(&mut self, bit_rate: BitRate) -> Result<(), Error> {
        self.run(lss::set_bit_rate(bit_rate, self.options))
    }

    /// Makes the selected slave keep its configuration.
    ///
    /// # Errors
    /// It is refused, no answer, or the bus is lost.
    pub fn store(&mut self) -> Result<(), Error> {
        self.run(lss::store(self.options))
    }

    /// Makes the selected slaves change to their new bit rate, `delay` ms from now; they are silent for twice that time.
    /// The bus of this host has to change too.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn activate(&mut self, delay: u16) -> Result<(), Error> {
        Ok(self.network.send(&lss::activate_bit_rate(delay))?)
    }

    /// Finds a slave without a node-ID, and selects it; `None` when there is none. It takes up to 133 times the time-out.
    ///
    /// `progress` is told how many of [`Fastscan::QUESTIONS`] have been asked.
    ///
    /// # Errors
    /// The bus is lost, or a slave that answered before does no more.
    pub fn fastscan(&mut self, mut progress: impl FnMut(u8)) -> Result<Option<Identity>, Error> {
        let mut scan = Fastscan::new(self.options);
        Ok(self.network.run_with(&mut scan, |scan| progress(scan.asked()))??)
    }

    /// Whether there is a slave without a node-ID.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn is_anybody_unconfigured(&mut self) -> Result<bool, Error> {
        Ok(self.network.run(&mut lss::identify_unconfigured(self.options))?.is_ok())
    }

    /// Runs a service that has an answer.
    fn run<T>(&mut self, mut service: impl Service<Output = Result<T, lss::Error>>) -> Result<T, Error> {
        Ok(self.network.run(&mut service)??)
    }
}
