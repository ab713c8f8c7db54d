//! The application of the CANopen device: what the personality adds to it.

use crate::flags::Flags;
use crate::stored::Stored;
use crate::transfer_buffer::TransferBuffer;
use crate::{Personality, REVISION, Setup, VENDOR_ID, pressure};
use canopen::dictionary::{Dictionary, Entry, Group, packed_size};
use canopen::emcy::Fault;
use canopen::sdo::Abort;
use canopen::{Application, Part};

/// Large enough for the values of every personality.
pub(crate) const IMAGE_SIZE: usize = pressure::IMAGE_SIZE;

/// The same for the parameters as they are stored.
pub(crate) const COMMUNICATION_SIZE: usize = packed_size(&pressure::OBJECTS, Group::Communication);
pub(crate) const APPLICATION_SIZE: usize = packed_size(&pressure::OBJECTS, Group::Application);
const _: () = assert!(COMMUNICATION_SIZE <= storage::MAX_VALUE && APPLICATION_SIZE <= storage::MAX_VALUE);

impl Personality {
    /// The dictionary that the node runs.
    pub(crate) fn dictionary(self) -> &'static Dictionary {
        match self {
            Personality::Pressure => &pressure::DICTIONARY,
        }
    }
}

/// The personality at work.
#[derive(Debug)]
pub(crate) struct Profile {
    pub(crate) setup: Setup,
    pub(crate) flags: Flags,
    pub(crate) stored: Stored,
    pub(crate) buffer: TransferBuffer,
}

impl Application for Profile {
    fn initialise(&mut self, image: &mut [u8]) {
        let setup = &self.setup;
        let dictionary = setup.personality.dictionary();
        let mut set = |index, sub, bytes: &[u8]| {
            if let Ok(entry) = dictionary.find(index, sub) {
                entry.field().set(image, bytes);
            }
        };
        set(0x1009, 0, setup.hardware_version.as_bytes());
        set(0x100A, 0, setup.software_version.as_bytes());
        set(0x1018, 1, &VENDOR_ID.to_le_bytes());
        set(0x1018, 2, &setup.personality.product_code().to_le_bytes());
        set(0x1018, 3, &REVISION.to_le_bytes());
        set(0x1018, 4, &setup.serial_number.to_le_bytes());
        set(0x1F56, 1, &setup.program_id.to_le_bytes());
        set(0x1F57, 1, &self.stored.flash_status().to_le_bytes());
        self.flags.store(image);
    }

    fn stored(&self, group: Group) -> canopen::Stored<'_> {
        self.stored.get(group)
    }

    fn loaded(&mut self, group: Group, good: bool) {
        let fault = match group {
            Group::Communication => Fault::CommunicationData,
            Group::Application => Fault::ApplicationData,
            Group::Volatile => return,
        };
        self.flags.set(fault, !good);
    }

    fn read_domain(&self, _number: u8) -> Result<&[u8], Abort> {
        self.buffer.read()
    }

    fn write_domain(&mut self, _number: u8, part: Part<'_>) -> Result<(), Abort> {
        self.buffer.write(part)
    }

    fn write(&mut self, number: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort> {
        match self.setup.personality {
            Personality::Pressure => pressure::write(number, entry, bytes, image),
        }
    }
}
