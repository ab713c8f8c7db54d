//! What the parameter store holds of the dictionary, kept in RAM for the resets to come: reset communication must not
//! wait for the flash.

use crate::Personality;
use crate::profile::{APPLICATION_SIZE, CALIBRATION_SIZE, COMMUNICATION_SIZE};
use canopen::dictionary::Group;
use embedded_storage::nor_flash::ReadNorFlash;
use heapless::{Vec, VecView};
use storage::{Health, View};

/// Version of the packed form (`canopen::dictionary`). The form says itself which objects it holds, so a dictionary
/// that grows needs no new version.
const FORM: u8 = 1;

/// The version under which a group is stored: the form in the low byte, and in the high byte the personality whose
/// dictionary it fits.
pub(crate) fn layout(personality: Personality) -> u16 {
    u16::from_le_bytes([FORM, personality.number()])
}

/// The calibration is that of the device, whatever its personality.
pub(crate) const CALIBRATION_LAYOUT: u16 = FORM as u16;

/// The packed values of one group. Nothing but zeros while there are none: no copy of that lies in flash.
#[derive(Debug)]
pub(crate) struct Kept<const N: usize> {
    pub(crate) packed: Vec<u8, N>,
    is_damaged: bool,
}

impl<const N: usize> Kept<N> {
    const EMPTY: Kept<N> = Kept { packed: Vec::new(), is_damaged: false };

    fn load<F: ReadNorFlash>(&mut self, group: storage::Group, layout: u16, view: &mut View<F>) {
        let is_sound = read(group, layout, view, &mut self.packed) && view.health(group) == Health::Good;
        self.is_damaged = !is_sound;
    }

    /// Takes what has just been stored.
    pub(crate) fn replace(&mut self, packed: &[u8]) {
        self.packed.clear();
        self.is_damaged = self.packed.extend_from_slice(packed).is_err();
    }

    pub(crate) fn get(&self) -> canopen::Stored<'_> {
        canopen::Stored { packed: &self.packed, is_sound: !self.is_damaged }
    }
}

/// The packed values of the groups that are stored.
#[derive(Debug)]
pub(crate) struct Stored {
    pub(crate) communication: Kept<COMMUNICATION_SIZE>,
    pub(crate) application: Kept<APPLICATION_SIZE>,
    pub(crate) calibration: Kept<CALIBRATION_SIZE>,
}

impl Stored {
    pub(crate) const NOTHING: Stored =
        Stored { communication: Kept::EMPTY, application: Kept::EMPTY, calibration: Kept::EMPTY };

    /// Reads all groups. What cannot be read counts as not stored, and as a fault.
    pub(crate) fn load<F: ReadNorFlash>(&mut self, layout: u16, view: &mut View<F>) {
        self.communication.load(storage::Group::Communication, layout, view);
        self.application.load(storage::Group::Application, layout, view);
        self.calibration.load(storage::Group::Calibration, CALIBRATION_LAYOUT, view);
    }

    /// 1F57h:1 as the running program gives it (CiA 302-3): 0, or in bits 1 to 7 code 3, format or CRC error.
    pub(crate) fn flash_status(&self) -> u32 {
        let is_damaged =
            self.communication.is_damaged || self.application.is_damaged || self.calibration.is_damaged;
        if is_damaged { 3 << 1 } else { 0 }
    }

    pub(crate) fn get(&self, group: Group) -> canopen::Stored<'_> {
        match group {
            Group::Communication => self.communication.get(),
            Group::Application => self.application.get(),
            Group::Calibration => self.calibration.get(),
        }
    }
}

/// Whether what is stored could be read; nothing stored is good, too.
fn read<F: ReadNorFlash>(
    group: storage::Group,
    layout: u16,
    view: &mut View<F>,
    packed: &mut VecView<u8>,
) -> bool {
    packed.clear();
    let _ = packed.resize(packed.capacity(), 0);
    let (len, is_good) = match view.load(group, packed) {
        Ok(Some(loaded)) if loaded.version == layout => (loaded.len, loaded.len > 0),
        // What another personality has stored is nothing to this one.
        Ok(Some(loaded)) => (0, loaded.version.to_le_bytes()[0] == FORM),
        Ok(None) => (0, true),
        Err(_) => (0, false),
    };
    packed.truncate(len);
    is_good
}
