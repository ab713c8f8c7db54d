//! Data sheets for the monitor, which judges the traffic of a bus.

use std::io;
use std::str::FromStr;

use canopen::NodeId;
use eds::{Access, Class, DEVICES, Eds, Entry, Formula, Value};
use monitor::{Initial, Kind, Sheet};

/// A node and the name of its device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Device {
    /// The node.
    pub node: NodeId,
    /// A personality of this project, or a file.
    pub name: String,
}

impl FromStr for Device {
    type Err = String;

    fn from_str(text: &str) -> Result<Device, String> {
        let parts = text.split_once('=');
        let device = parts.and_then(|(node, name)| {
            let node = NodeId::new(node.trim().parse().ok()?)?;
            Some(Device { node, name: name.trim().to_owned() })
        });
        device.ok_or_else(|| format!("{text:?} is no node and its device, as 1=pressure or 5=drive.eds"))
    }
}

impl Device {
    /// The data sheet for the monitor.
    ///
    /// # Errors
    /// The file cannot be read, or is no data sheet.
    pub fn sheet(&self) -> Result<Sheet, String> {
        let own = DEVICES.iter().find(|device| device.file_name == format!("{}.eds", self.name));
        if let Some(own) = own {
            return Ok(Sheet::of_node(own.rows));
        }
        let no_personality = |error: io::Error| {
            let names: Vec<&str> =
                DEVICES.iter().map(|device| device.file_name.trim_end_matches(".eds")).collect();
            format!("no personality ({}) and no data sheet: {error}", names.join(", "))
        };
        let bytes = wire::input::read(self.name.as_ref(), 4 << 20).map_err(no_personality)?;
        let sheet = Eds::from_bytes(&bytes).map_err(|error| error.to_string())?;
        Ok(of_data_sheet(&sheet, self.node))
    }
}

/// The sheet of a data sheet. A data sheet does not tell which values are saved, or which values a device changes by
/// itself: only the communication parameters are judged as parameters.
#[must_use]
pub fn of_data_sheet(eds: &Eds, node: NodeId) -> Sheet {
    let entries = eds.entries().map(|entry| {
        let is_parameter =
            entry.access == Access::ReadWrite && Sheet::is_communication_parameter((entry.index, entry.sub));
        monitor::Entry {
            kind: if is_parameter { Kind::Parameter } else { Kind::Volatile },
            initial: initial(entry, node),
            group: is_parameter.then_some(2),
        }
    });
    let keys = eds.entries().map(|entry| (entry.index, entry.sub));
    // Any object of the manufacturer may change the PDOs.
    let others = eds.objects.keys().copied().filter(|index| *index >= 0x2000);
    Sheet { entries: keys.zip(entries).collect(), changes_pdos: others.collect(), ..Sheet::default() }
}

fn initial(entry: &Entry, node: NodeId) -> Initial {
    let (Class::Signed(bits) | Class::Unsigned(bits)) = entry.data_type.class() else {
        return Initial::Unknown;
    };
    match &entry.default {
        Some(Formula::NodeId(base)) => u32::try_from(*base).map_or(Initial::Unknown, Initial::NodeId),
        Some(formula) => match formula.evaluate(node) {
            Value::Integer(value) => {
                let size = usize::from(bits.div_ceil(8)).min(8);
                Initial::Bytes(value.to_le_bytes()[..size].to_vec())
            }
            _ => Initial::Unknown,
        },
        None => Initial::Unknown,
    }
}
