//! A device configuration file: the data sheet with the values of one device (CiA 306).

use std::fmt;

use canopen::eds::Writer;

use crate::{Eds, Reals};

/// Section `[DeviceComissioning]` (with this spelling): the device that the values are for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// The node-ID.
    pub node_id: u8,
    /// The bit rate in kbit/s; `None` where it is not known.
    pub bit_rate: Option<u16>,
    /// The serial number, 1018h:4.
    pub serial: u32,
}

impl Eds {
    /// The text of a configuration file of this name. Values are those of [`Entry::value`](crate::Entry::value).
    #[must_use]
    pub fn to_dcf(&self, file_name: &str, reals: Reals) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write_dcf(file_name, reals, &mut Writer::new(&mut text));
        text
    }

    fn write_dcf(&self, file_name: &str, reals: Reals, out: &mut Writer<'_, String>) -> fmt::Result {
        out.section("FileInfo", "")?;
        out.key("FileName", file_name)?;
        out.key("FileVersion", 1)?;
        out.key("FileRevision", 0)?;
        out.key("EDSVersion", "4.0")?;
        out.key("Description", format_args!("Configuration of {}", self.device.product_name))?;
        out.key("CreatedBy", "nodectl")?;
        self.device.write(out)?;
        let Commissioning { node_id, bit_rate, serial } = self.commissioning.unwrap_or_default();
        out.section("DeviceComissioning", "")?;
        out.key("NodeID", node_id)?;
        bit_rate.iter().try_for_each(|rate| out.key("Baudrate", rate))?;
        out.key("NetNumber", 0)?;
        out.key("CANopenManager", 0)?;
        out.key("LSS_SerialNumber", format_args!("0x{serial:08X}"))?;
        self.write_objects(reals, out)
    }
}
