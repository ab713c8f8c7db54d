//! The device record in the parameter store: personality, node-ID and bit rate of the next start.

use crate::Setup;
use canopen::lss::{BitRate, Configuration};
use canopen::{Job, NodeId};
use profiles::Personality;
use storage::DeviceRecord;

/// The content of the device record.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Configured {
    lss: Configuration,
    pub(crate) personality: Personality,
}

impl Configured {
    /// The configuration with which the node was set up.
    pub(crate) fn of(setup: &Setup) -> Configured {
        let lss = Configuration { node_id: setup.node_id, bit_rate: setup.bit_rate };
        Configured { lss, personality: setup.personality }
    }

    pub(crate) fn set_bit_rate(&mut self, bit_rate: BitRate) {
        self.lss.bit_rate = bit_rate;
    }

    /// The configuration after a job.
    pub(crate) fn after(self, job: Job) -> Configured {
        match job {
            Job::Configure(lss) => Configured { lss, ..self },
            Job::Setting(number) => {
                let personality = Personality::numbered(number).unwrap_or(self.personality);
                Configured { personality, ..self }
            }
            Job::Store(_) | Job::Restore(_) => self,
        }
    }

    /// The record to be stored.
    pub(crate) fn encode(self) -> [u8; DeviceRecord::LEN] {
        let node_id = self.lss.node_id.map_or(DeviceRecord::UNCONFIGURED, NodeId::get);
        let record = DeviceRecord::new(node_id, self.lss.bit_rate.kbit(), self.personality.number());
        record.map_or([0; DeviceRecord::LEN], |record| record.encode())
    }
}
