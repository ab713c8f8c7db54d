//! What a device does beyond CANopen, as the device sees it.

use crate::dictionary::Entry;
use crate::sdo::Abort;

/// The part of a personality that is code: rules of its own objects.
pub trait Application {
    /// Fills in what no table can know (identity, versions), after every reset.
    fn initialise(&mut self, image: &mut [u8]);

    /// Decides on an SDO download to an entry with [`Rule::Application`](crate::dictionary::Rule::Application) of
    /// this number; type and limits are checked already. It may change other values. The device stores the bytes.
    ///
    /// # Errors
    /// The reason to refuse it; nothing is stored then.
    fn write(&mut self, number: u8, entry: &Entry, bytes: &[u8], image: &mut [u8]) -> Result<(), Abort>;
}
