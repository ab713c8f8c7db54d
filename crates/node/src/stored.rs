//! A copy of the stored dictionary values in RAM for later resets, because reset communication must not wait for the
//! flash.

use canopen::dictionary::Group;
use canopen::{Damage, Soundness};
use embedded_storage::nor_flash::ReadNorFlash;
use profiles::Personality;
use storage::{Health, View};

use crate::packed::{PackedGroups, number_of};

/// Version of the packed form (`canopen::dictionary`). The form itself lists the objects that it holds, so a dictionary
/// that grows needs no new version.
const FORM: u8 = 1;

/// The version under which a group is stored: the form in the low byte, the personality in the high byte.
pub(crate) fn layout(personality: Personality) -> u16 {
    u16::from_le_bytes([FORM, personality.number()])
}

/// The version of one group. The calibration belongs to the device, whatever the personality.
pub(crate) fn layout_of(group: Group, layout: u16) -> u16 {
    if group == Group::Calibration { FORM.into() } else { layout }
}

/// The stored values, and how far they can be trusted.
#[derive(Debug)]
pub(crate) struct Stored {
    packed: PackedGroups,
    damage: Damage,
}

impl Stored {
    pub(crate) const NOTHING: Stored = Stored { packed: PackedGroups::EMPTY, damage: Damage::NONE };

    /// Reads all groups. A group that cannot be read counts as not stored, and as a fault.
    pub(crate) fn load<F: ReadNorFlash>(&mut self, layout: u16, view: &mut View<F>) {
        for group in Group::COMMON {
            let mut is_readable = true;
            self.packed.fill(group, |bytes| {
                let read = read(group, layout_of(group, layout), view, bytes);
                is_readable = read.is_some();
                read.unwrap_or(0)
            });
            let soundness = match view.health(number_of(group)) {
                Health::Good if is_readable => Soundness::Whole,
                Health::FellBack if is_readable => Soundness::Older,
                _ => Soundness::Lost,
            };
            self.damage.set(group, soundness);
        }
    }

    /// Takes values that have just been stored.
    pub(crate) fn replace(&mut self, group: Group, packed: &[u8]) {
        let fits = self.packed.replace(group, packed);
        self.damage.set(group, if fits { Soundness::Whole } else { Soundness::Lost });
    }

    /// 1F57h:1 of the running program (CiA 302-3): 0, or code 3 (format or CRC error) in bits 1 to 7.
    pub(crate) fn flash_status(&self) -> u32 {
        if self.damage == Damage::NONE { 0 } else { 3 << 1 }
    }

    pub(crate) fn get(&self, group: Group) -> canopen::Stored<'_> {
        canopen::Stored { packed: self.packed.get(group), soundness: self.damage.of(group) }
    }
}

/// Number of stored bytes of the group; `None` for a damaged group. A group that was never stored is not damaged.
fn read<F: ReadNorFlash>(group: Group, layout: u16, view: &mut View<F>, bytes: &mut [u8]) -> Option<usize> {
    match view.load(number_of(group), bytes) {
        Ok(Some(loaded)) if loaded.version == layout => Some(loaded.len).filter(|len| *len > 0),
        // Values that another personality has stored do not apply to this one.
        Ok(Some(loaded)) => (loaded.version.to_le_bytes()[0] == FORM).then_some(0),
        Ok(None) => Some(0),
        Err(_) => None,
    }
}
