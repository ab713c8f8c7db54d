//! What travels to the parameter store: a copy of the values, so that nothing is locked while they are written.

use crate::profile::{APPLICATION_SIZE, CALIBRATION_SIZE, COMMUNICATION_SIZE};
use crate::stored::CALIBRATION_LAYOUT;
use canopen::Job;
use canopen::dictionary;
use canopen::sdo::Abort;
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
    /// Of the packed values, but for the calibration.
    pub(crate) layout: u16,
    pub(crate) device: [u8; DeviceRecord::LEN],
    pub(crate) communication: Vec<u8, COMMUNICATION_SIZE>,
    pub(crate) application: Vec<u8, APPLICATION_SIZE>,
    pub(crate) calibration: Vec<u8, CALIBRATION_SIZE>,
}

impl Parcel {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Parcel {
        Parcel {
            job: None,
            layout: 0,
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
    pub fn deliver<F: NorFlash>(&self, store: &mut Store<F>) -> Result<(), Abort> {
        let changes: Vec<Change<'_>, GROUPS> = match self.job {
            None => Vec::new(),
            Some(Job::Configure(_) | Job::Set(_)) => some([Some(self.change(Group::Device))]),
            Some(Job::Save(selection)) => {
                some(SAVED.map(|(group, of)| selection.contains(of).then(|| self.change(group))))
            }
            Some(Job::Restore(selection)) => {
                some(SAVED.map(|(group, of)| selection.contains(of).then_some(Change::Restore(group))))
            }
        };
        store.save(&changes).map_err(|error| match error {
            Error::RestartNeeded => Abort::DeviceState,
            _ => Abort::Hardware,
        })
    }

    fn change(&self, group: Group) -> Change<'_> {
        match group {
            Group::Calibration => set(group, CALIBRATION_LAYOUT, &self.calibration),
            Group::Application => set(group, self.layout, &self.application),
            Group::Communication => set(group, self.layout, &self.communication),
            Group::Device => set(group, DeviceRecord::VERSION, &self.device),
        }
    }
}

impl Default for Parcel {
    fn default() -> Parcel {
        Parcel::new()
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
