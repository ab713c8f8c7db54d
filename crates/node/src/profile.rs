//! The application of the CANopen device: what the personality adds to it.

use crate::configured::Configured;
use crate::dictionaries::TABLES;
use crate::flags::Flags;
use crate::lost_events::LOST_EVENTS;
use crate::manufacturer::PERSONALITY;
use crate::personality::Definition;
use crate::stored::Stored;
use crate::transfer_buffer::TransferBuffer;
use crate::{Fault, REVISION, Setup, Snapshot, VENDOR_ID, combined, encoder, lift, pressure};
use canopen::dictionary::{Entry, Group, packed_size};
use canopen::sdo::{Abort, Multiplexer};
use canopen::{Application, Condition, Part};
use profiles::lift::panel::{LAMPS, Lamp};

/// Large enough for the values of every personality.
pub(crate) const IMAGE_SIZE: usize =
    largest([pressure::IMAGE_SIZE, encoder::IMAGE_SIZE, combined::IMAGE_SIZE, lift::IMAGE_SIZE]);

/// The same for the parameters as they are stored.
pub(crate) const COMMUNICATION_SIZE: usize = largest_packed(Group::Communication);
pub(crate) const APPLICATION_SIZE: usize = largest_packed(Group::Application);
pub(crate) const CALIBRATION_SIZE: usize = largest_packed(Group::Calibration);
const _: () = assert!(COMMUNICATION_SIZE <= storage::MAX_VALUE && APPLICATION_SIZE <= storage::MAX_VALUE);
const _: () = assert!(CALIBRATION_SIZE <= storage::MAX_VALUE);

const fn largest_packed(group: Group) -> usize {
    let [a, b, c, d] = TABLES;
    largest([packed_size(a, group), packed_size(b, group), packed_size(c, group), packed_size(d, group)])
}

const fn largest(sizes: [usize; TABLES.len()]) -> usize {
    let (mut largest, mut i) = (0, 0);
    while i < sizes.len() {
        largest = if sizes[i] > largest { sizes[i] } else { largest };
        i += 1;
    }
    largest
}

/// The personality at work.
#[derive(Debug)]
pub(crate) struct Profile {
    pub(crate) setup: Setup,
    pub(crate) configured: Configured,
    /// As last published: a reset of the dictionary does not reset what is measured.
    pub(crate) snapshot: Snapshot,
    pub(crate) flags: Flags,
    pub(crate) stored: Stored,
    pub(crate) buffer: TransferBuffer,
    /// As counted by the firmware (2001h).
    pub(crate) lost_events: [u32; LOST_EVENTS],
    lamps: [Lamp; LAMPS],
}

impl Profile {
    pub(crate) fn new(setup: &Setup) -> Profile {
        Profile {
            setup: *setup,
            configured: Configured::of(setup),
            snapshot: Snapshot::default(),
            flags: Flags::default(),
            stored: Stored::NOTHING,
            buffer: TransferBuffer::EMPTY,
            lost_events: [0; LOST_EVENTS],
            lamps: [Lamp::default(); LAMPS],
        }
    }

    pub(crate) fn definition(&self) -> &'static Definition {
        self.setup.personality.definition()
    }

    /// Shows what was measured.
    pub(crate) fn show_values(&self, image: &mut [u8]) {
        let (definition, snapshot) = (self.definition(), &self.snapshot);
        if let (Some(fields), Some(snapshot)) = (definition.pressure, &snapshot.pressure) {
            fields.publish(snapshot, image);
        }
        if let (Some(fields), Some(snapshot)) = (definition.encoder, &snapshot.encoder) {
            fields.publish(snapshot, image);
        }
        if let (Some(fields), Some(snapshot)) = (definition.lift, &snapshot.lift) {
            fields.publish(snapshot, image);
        }
    }

    /// Lets the lamps follow the virtual output, where there are any.
    pub(crate) fn follow_output(&mut self, image: &mut [u8]) {
        if let Some(fields) = self.definition().lift {
            fields.follow_output(&mut self.lamps, image);
        }
    }

    /// Which lamps are lit.
    pub(crate) fn lit(&self, image: &[u8]) -> [bool; LAMPS] {
        self.definition().lift.map_or([false; LAMPS], |fields| fields.lit(image))
    }

    /// Shows the flags, where the personality has them.
    pub(crate) fn show_flags(&self, image: &mut [u8]) {
        if let Some(fields) = self.definition().flags {
            self.flags.store(fields, image);
        }
    }

    /// Shows the personality after the next reset.
    pub(crate) fn show_personality(&self, image: &mut [u8]) {
        self.show(PERSONALITY, 0, &[self.configured.personality.number()], image);
    }

    pub(crate) fn show(&self, index: u16, sub: u8, bytes: &[u8], image: &mut [u8]) {
        if let Ok(entry) = self.definition().dictionary.find(index, sub) {
            entry.field().set(image, bytes);
        }
    }
}

impl Application for Profile {
    const CONDITIONS: &'static [Condition] = &Fault::CONDITIONS;

    fn initialise(&mut self, image: &mut [u8]) {
        let setup = &self.setup;
        let mut show = |index, sub, bytes: &[u8]| self.show(index, sub, bytes, image);
        show(0x1009, 0, setup.hardware_version.as_bytes());
        show(0x100A, 0, setup.software_version.as_bytes());
        show(0x1018, 1, &VENDOR_ID.to_le_bytes());
        show(0x1018, 2, &setup.personality.product_code().to_le_bytes());
        show(0x1018, 3, &REVISION.to_le_bytes());
        show(0x1018, 4, &setup.serial_number.to_le_bytes());
        show(0x1F56, 1, &setup.program_id.to_le_bytes());
        show(0x1F57, 1, &self.stored.flash_status().to_le_bytes());
        if let Some(fields) = self.definition().encoder {
            fields.initialise(setup.serial_number, image);
        }
        if let Some(fields) = self.definition().lift {
            fields.initialise(image);
        }
        self.show_personality(image);
        self.show_flags(image);
        self.show_lost_events(image);
        self.show_values(image);
    }

    fn written(&mut self, _: &Entry, image: &mut [u8]) {
        self.follow_output(image);
    }

    fn received(&mut self, _: u16, image: &mut [u8]) {
        self.follow_output(image);
    }

    fn stored(&self, group: Group) -> canopen::Stored<'_> {
        // A personality without the pressure channel leaves the calibration alone.
        let has_it = group != Group::Calibration || self.definition().is_calibrated();
        if has_it { self.stored.get(group) } else { canopen::Stored { packed: &[], is_sound: true } }
    }

    fn loaded(&mut self, group: Group, good: bool) {
        self.flags.set_stored(group, !good);
    }

    fn read_domain(&self, _: Multiplexer) -> Result<&[u8], Abort> {
        self.buffer.read()
    }

    fn write_domain(&mut self, _: Multiplexer, part: Part<'_>) -> Result<(), Abort> {
        self.buffer.write(part)
    }

    fn write(&mut self, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        match self.definition() {
            Definition { lift: Some(fields), .. } => fields.write(entry, bytes, image),
            Definition { pressure: Some(fields), .. } if fields.decides_on(entry) => {
                fields.write(entry, bytes, image)
            }
            Definition { encoder: Some(fields), .. } => fields.write(entry, bytes, image),
            _ => Ok(()),
        }
    }
}
