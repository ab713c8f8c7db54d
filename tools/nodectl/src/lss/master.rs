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
    /// All slaves on the bus. Their answers are only of use where there is a single slave.
    All,
    /// The slave with this identity.
    One(Identity),
}

/// The LSS master.
pub struct Master<'n> {
    network: &'n mut Network,
    options: Options,
}

impl<'n> Master<'n> {
    /// A master with this time-out for answers, and the usual number of retries.
    pub fn new(network: &'n mut Network, timeout: Duration) -> Master<'n> {
        Master { network, options: Options { timeout, ..Options::default() } }
    }

    /// Switches slaves to the state Configuration.
    ///
    /// # Errors
    /// No slave has this identity, or the bus is lost. The selection of all slaves is not answered.
    pub fn select(&mut self, selection: Selection) -> Result<(), Error> {
        self.release()?;
        match selection {
            Selection::All => Ok(self.network.send(&lss::switch_global(true))?),
            Selection::One(identity) => self.run(lss::select(&identity, self.options)),
        }
    }

    /// Switches all slaves back to the state Waiting. Slaves without a node-ID boot with their new one.
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

    /// The node-ID of the selected slave; `None` when the slave has none.
    ///
    /// # Errors
    /// No answer, or the bus is lost.
    pub fn node_id(&mut self) -> Result<Option<NodeId>, Error> {
        self.run(lss::inquire_node_id(self.options))
    }

    /// Sets the node-ID of the selected slave; `None` takes it away.
    ///
    /// # Errors
    /// The slave refuses, no slave answers, or the bus is lost.
    pub fn set_node_id(&mut self, node_id: Option<NodeId>) -> Result<(), Error> {
        self.run(lss::set_node_id(node_id, self.options))
    }

    /// Sets the bit rate of the selected slave. The bit rate is used after [`activate`](Master::activate) or at the
    /// next start.
    ///
    /// # Errors
    /// The slave refuses, no slave answers, or the bus is lost.
    pub fn set_bit_rate(&mut self, bit_rate: BitRate) -> Result<(), Error> {
        self.run(lss::set_bit_rate(bit_rate, self.options))
    }

    /// Makes the selected slave store its configuration.
    ///
    /// # Errors
    /// The slave refuses, no slave answers, or the bus is lost.
    pub fn store(&mut self) -> Result<(), Error> {
        self.run(lss::store(self.options))
    }

    /// Makes the selected slaves change to their new bit rate, `delay` ms from now. The slaves are silent for twice
    /// that time. The caller has to change the bit rate of this host's bus, too.
    ///
    /// # Errors
    /// The bus is lost.
    pub fn activate(&mut self, delay: u16) -> Result<(), Error> {
        Ok(self.network.send(&lss::activate_bit_rate(delay))?)
    }

    /// Finds a slave without a node-ID, and selects it; `None` without such a slave. Takes up to 133 times the time-out.
    ///
    /// `progress` is called with the number of questions asked, out of [`Fastscan::QUESTIONS`].
    ///
    /// # Errors
    /// The bus is lost, or a slave that has answered before stops answering.
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
