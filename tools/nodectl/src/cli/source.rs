//! The values that `monitor` and `record` acquire.

use canopen::Duration;
use clap::Args;

use super::{Failure, Output, Session};
use crate::acquisition::{Acquisition, Setup};

/// The values to acquire, and the way to acquire them.
#[derive(Debug, Args)]
pub(super) struct Source {
    /// Objects by index or name; without any, all objects in TPDOs. Objects in a TPDO are taken from the TPDO.
    #[arg(value_name = "OBJECT")]
    objects: Vec<String>,

    /// The period of reading the objects that no TPDO carries, in milliseconds.
    #[arg(long, value_name = "MS", default_value_t = 100)]
    period: u32,

    /// Start the node first: TPDOs come in the state operational only.
    #[arg(long)]
    start: bool,
}

impl Source {
    /// Opens the acquisition of the session's node; results go to the session's output.
    pub(super) fn open<'s>(
        &self,
        session: &'s mut Session,
    ) -> Result<(Acquisition<'s>, &'s mut Output), Failure> {
        let node = session.options.node.one()?;
        let catalogue = session.catalogue(node)?;
        let objects: Result<Vec<_>, Failure> =
            self.objects.iter().map(|query| session.find(node, query)).collect();
        let period = Duration::from_millis(self.period.max(1).into());
        let setup = Setup { node, options: session.options.sdo(), period, start: self.start };
        let acquisition = Acquisition::open(&mut session.network, setup, &catalogue, &objects?)?;
        if acquisition.signals().is_empty() {
            let message = "the node has no TPDO that is switched on: name the objects";
            return Err(Failure::Usage(message.to_owned()));
        }
        Ok((acquisition, &mut session.output))
    }
}
