//! What travels to the parameter store: a copy of the values, so that nothing is locked while they are written.

use crate::Personality;
use crate::profile::{APPLICATION_SIZE, CALIBRATION_SIZE, COMMUNICATION_SIZE, IMAGE_SIZE};
use crate::stored::{CALIBRATION_LAYOUT, layout};
use canopen::dictionary::{self, Groups};
use canopen::sdo::Abort;
use canopen::{Job, NodeId};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use storage::{Change, DeviceRecord, Error, Group, Store};

/// How many groups hold values of the dictionary.
const GROUPS: usize = 3;

/// They, and what the dictionary calls them.
const SAVED: [(Group, dictionary::Group); GROUPS] = [
    (Group::Communication, dictionary::Group::Communication),
    (Group::Application, dictionary::Group::Application),
    (Group::Calibration, dictionary::Group::Calibration),
];

/// A job for the parameter store and all it needs. One is enough: there is one job at a time.
#[derive(Debug)]
pub struct Parcel {
    pub(crate) job: Option<Job>,
    pub(crate) personality: Personality,
    pub(crate) node_id: Option<NodeId>,
    /// The values of all objects.
    pub(crate) image: [u8; IMAGE_SIZE],
    pub(crate) device: [u8; DeviceRecord::LEN],
    pub(crate) communication: Vec<u8, COMMUNICATION_SIZE>,
    pub(crate) application: Vec<u8, APPLICATION_SIZE>,
    pub(crate) calibration: Vec<u8, CALIBRATION_SIZE>,
}

impl Parcel {
    /// An empty one, for a node of this personality. A constant of its size would lie in flash.
    #[must_use]
    pub fn new(personality: Personality) -> Parcel {
        Parcel {
            job: None,
            personality,
            node_id: None,
            image: [0; IMAGE_SIZE],
            device: [0; DeviceRecord::LEN],
            communication: Vec::new(),
            application: Vec::new(),
            calibration: Vec::new(),
        }
    }

    /// Does the job: all of it or nothing. It takes as long as the flash does, some 16 us a word.
    ///
    /// # Errors
    /// What to tell the client: `Hardware` when the flash has failed, `DeviceState` when there is no room left until the
    /// node is restarted.
    pub fn deliver<F: NorFlash>(&mut self, store: &mut Store<F>) -> Result<(), Abort> {
        self.pack();
        let changes: Vec<Change<'_>, GROUPS> = match self.job {
            None => Vec::new(),
            Some(Job::Configure(_) | Job::Setting(_)) => some([Some(self.change(Group::Device))]),
            Some(Job::Store(groups)) => {
                some(SAVED.map(|(group, of)| groups.contains(of).then(|| self.change(group))))
            }
            Some(Job::Restore(groups)) => {
                some(SAVED.map(|(group, of)| groups.contains(of).then_some(Change::Restore(group))))
            }
        };
        store.save(&changes).map_err(|error| match error {
            Error::RestartNeeded => Abort::DeviceState,
            _ => Abort::Hardware,
        })
    }

    /// Packs what is saved; of what is restored there is nothing to pack.
    fn pack(&mut self) {
        self.communication.clear();
        self.application.clear();
        self.calibration.clear();
        if let Some(Job::Store(groups)) = self.job {
            let values = Values { personality: self.personality, node_id: self.node_id, image: &self.image };
            values.pack(dictionary::Group::Communication, groups, &mut self.communication);
            values.pack(dictionary::Group::Application, groups, &mut self.application);
            values.pack(dictionary::Group::Calibration, groups, &mut self.calibration);
        }
    }

    fn change(&self, group: Group) -> Change<'_> {
        match group {
            Group::Calibration => set(group, CALIBRATION_LAYOUT, &self.calibration),
            Group::Application => set(group, layout(self.personality), &self.application),
            Group::Communication => set(group, layout(self.personality), &self.communication),
            Group::Device => set(group, DeviceRecord::VERSION, &self.device),
        }
    }
}

/// What is packed.
struct Values<'a> {
    personality: Personality,
    node_id: Option<NodeId>,
    image: &'a [u8],
}

impl Values<'_> {
    fn pack<const N: usize>(&self, group: dictionary::Group, groups: Groups, out: &mut Vec<u8, N>) {
        if groups.contains(group) {
            let dictionary = self.personality.definition().dictionary;
            // The buffers are as large as the largest dictionary needs: `profile` computes them from the tables.
            let _ = out.resize(N, 0);
            let len = dictionary.pack(group, self.node_id, self.image, out).unwrap_or(0);
            out.truncate(len);
        }
    }
}

const fn set(group: Group, version: u16, value: &[u8]) -> Change<'_> {
    Change::Set { group, version, value }
}

/// Those that are there.
fn some<const N: usize>(changes: [Option<Change<'_>>; N]) -> Vec<Change<'_>, GROUPS> {
    let mut all = Vec::new();
    for change in changes.into_iter().flatten() {
        let _ = all.push(change);
    }
    all
}
