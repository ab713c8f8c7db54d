//! A job for the parameter store, with a copy of the values, so that nothing is locked during the write.

use canopen::dictionary::{Group, Groups};
use canopen::sdo::Abort;
use canopen::{Job, NodeId};
use embedded_storage::nor_flash::NorFlash;
use heapless::Vec;
use profiles::{IMAGE_SIZE, Personality};
use storage::{Change, DeviceRecord, Error, Store};

use crate::device_value;
use crate::packed::{PackedGroups, number_of};
use crate::stored::{layout, layout_of};

/// A job for the parameter store with all its data. One is enough, because there is one job at a time.
#[derive(Debug)]
pub struct StoreJob {
    pub(crate) job: Option<Job>,
    pub(crate) personality: Personality,
    pub(crate) node_id: Option<NodeId>,
    /// The values of all objects.
    pub(crate) image: [u8; IMAGE_SIZE],
    /// The device record, for a job that stores node-ID, bit rate or personality.
    pub(crate) device: [u8; DeviceRecord::LEN],
    /// The packed groups to be stored.
    pub(crate) packed: PackedGroups,
}

impl StoreJob {
    /// An empty job for a node of this personality. Not a constant, because a constant of this size would be in flash.
    #[must_use]
    pub fn new(personality: Personality) -> StoreJob {
        StoreJob {
            job: None,
            personality,
            node_id: None,
            image: [0; IMAGE_SIZE],
            device: [0; DeviceRecord::LEN],
            packed: PackedGroups::EMPTY,
        }
    }

    /// Does the whole job or nothing. The time depends on the flash: some 16 us a word.
    ///
    /// # Errors
    /// The abort code for the client: `Hardware` if the flash has failed, `DeviceState` if there is no room left.
    pub fn run<F: NorFlash>(&mut self, store: &mut Store<F>) -> Result<(), Abort> {
        self.pack();
        if let Some(Job::Configure(_) | Job::Setting(_)) = self.job {
            return device_value::replace_device(self.device, store).map_err(|error| abort_of(&error));
        }
        let changes = match self.job {
            None | Some(Job::Configure(_) | Job::Setting(_)) => Vec::new(),
            Some(Job::Store(groups)) => each(groups, |group| self.stored(group)),
            Some(Job::Restore(groups)) => each(groups, |group| Change::Restore(number_of(group))),
        };
        store.save(&changes).map_err(|error| abort_of(&error))
    }

    /// Packs the groups to be stored; a restore has nothing to pack.
    fn pack(&mut self) {
        let Some(Job::Store(groups)) = self.job else { return };
        for group in groups.iter() {
            let (dictionary, image) = (self.personality.dictionary(), &self.image);
            self.packed.fill(group, |bytes| dictionary.pack(group, self.node_id, image, bytes).unwrap_or(0));
        }
    }

    fn stored(&self, group: Group) -> Change<'_> {
        let version = layout_of(group, layout(self.personality));
        Change::Set { group: number_of(group), version, value: self.packed.get(group) }
    }
}

fn abort_of<E>(error: &Error<E>) -> Abort {
    match error {
        Error::Full => Abort::DeviceState,
        _ => Abort::Hardware,
    }
}

/// At most one change a group.
type Changes<'a> = Vec<Change<'a>, { Group::COMMON.len() }>;

fn each<'a>(groups: Groups, change: impl Fn(Group) -> Change<'a>) -> Changes<'a> {
    let mut changes = Vec::new();
    for group in groups.iter() {
        // There is room for every group.
        let _ = changes.push(change(group));
    }
    changes
}
