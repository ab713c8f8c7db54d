//! What travels to the parameter store: a copy of the values, so that nothing is locked while they are written.

use crate::profile::{APPLICATION_SIZE, COMMUNICATION_SIZE};
use canopen::dictionary;
use canopen::sdo::Abort;
use canopen::{Job, Selection};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use storage::{Change, DeviceRecord, Error, Group, Store};

/// A job for the parameter store and all it needs. One is enough: there is one job at a time.
#[derive(Debug)]
pub struct Parcel {
    pub(crate) job: Option<Job>,
    /// Of the packed values.
    pub(crate) layout: u16,
    pub(crate) device: [u8; DeviceRecord::LEN],
    pub(crate) communication: Vec<u8, COMMUNICATION_SIZE>,
    pub(crate) application: Vec<u8, APPLICATION_SIZE>,
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
        }
    }

    /// Does the job: all of it or nothing. It takes as long as the flash does, some 16 us a word.
    ///
    /// # Errors
    /// What to tell the client: `Hardware` when the flash has failed, `DeviceState` when there is no room left until the
    /// node is restarted.
    pub fn deliver<F: NorFlash>(&self, store: &mut Store<F>) -> Result<(), Abort> {
        let [communication, application] = [Group::Communication, Group::Application];
        let changes: Vec<Change<'_>, 2> = match self.job {
            None => Vec::new(),
            Some(Job::Configure(_) | Job::Set(_)) => {
                some([Some(set(Group::Device, DeviceRecord::VERSION, &self.device))])
            }
            Some(Job::Save(selection)) => some(
                [communication, application]
                    .map(|group| selects(selection, group).then(|| self.change(group))),
            ),
            Some(Job::Restore(selection)) => some(
                [communication, application]
                    .map(|group| selects(selection, group).then_some(Change::Restore(group))),
            ),
        };
        store.save(&changes).map_err(|error| match error {
            Error::RestartNeeded => Abort::DeviceState,
            _ => Abort::Hardware,
        })
    }

    fn change(&self, group: Group) -> Change<'_> {
        let value: &[u8] =
            if group == Group::Communication { &self.communication } else { &self.application };
        set(group, self.layout, value)
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

fn selects(selection: Selection, group: Group) -> bool {
    let of = if group == Group::Communication {
        dictionary::Group::Communication
    } else {
        dictionary::Group::Application
    };
    selection.contains(of)
}

/// Those that are there, of at most two.
fn some<const N: usize>(changes: [Option<Change<'_>>; N]) -> Vec<Change<'_>, 2> {
    let mut all = Vec::new();
    for change in changes.into_iter().flatten() {
        let _ = all.push(change);
    }
    all
}
