//! What a device does beyond CANopen, as the device sees it.

use super::Stored;
use crate::dictionary::{Entry, Group};
use crate::sdo::Abort;

/// The part of a personality that is code: rules of its own objects.
pub trait Application {
    /// A device without PDO, SYNC, EMCY, heartbeat consumer, stored parameters and block upload, such as a bootloader. Its
    /// dictionary has none of their objects, and the code for them is left out of the image.
    const SERVICES_ONLY: bool = false;

    /// Fills in what no table can know (identity, versions), after every reset.
    fn initialise(&mut self, image: &mut [u8]);

    /// Decides on an SDO download to an entry with [`Rule::Application`](crate::dictionary::Rule::Application) of
    /// this number; type and limits are checked already. It may change other values. The device stores the bytes.
    ///
    /// # Errors
    /// The reason to refuse it; nothing is stored then.
    fn write(&mut self, number: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort>;

    /// What is stored of a group, for every reset that covers it.
    fn stored(&self, _group: Group) -> Stored<'_> {
        Stored { packed: &[], is_sound: true }
    }

    /// Whether what is stored of a group was sound and fitted the dictionary. Where it did not fit, the group has its
    /// defaults.
    fn loaded(&mut self, _group: Group, _good: bool) {}

    /// The content of the domain with the rule of this number.
    ///
    /// # Errors
    /// The reason why it cannot be read.
    fn read_domain(&self, _number: u8) -> Result<&[u8], Abort> {
        Err(Abort::Access)
    }

    /// A download to a domain: its parts come in order, from [`Part::Begin`] to [`Part::End`]. A download that is given
    /// up has no end.
    ///
    /// # Errors
    /// The reason to refuse the part and with it the download.
    fn write_domain(&mut self, _number: u8, _part: Part<'_>) -> Result<(), Abort> {
        Err(Abort::Access)
    }
}

/// A part of a download to a domain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part<'a> {
    /// It begins; so many bytes will come, where the client says so.
    Begin(Option<usize>),
    /// Bytes and the place of the first of them.
    Data(usize, &'a [u8]),
    /// It is complete, with so many bytes.
    End(usize),
}
