//! Which virtual devices a node is. One object (2305h) chooses them; a node as delivered is none.

/// Virtual devices, a bit for each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Devices(pub u8);

impl Devices {
    /// Car position units.
    pub const POSITION: Devices = Devices(1 << 0);
    /// A load measuring unit.
    pub const LOAD: Devices = Devices(1 << 1);
    /// An input panel unit.
    pub const INPUT_PANEL: Devices = Devices(1 << 2);
    /// An output panel unit.
    pub const OUTPUT_PANEL: Devices = Devices(1 << 3);
    /// How many there are to choose from.
    pub const KINDS: usize = 4;
    /// All of them.
    pub const ALL: Devices = Devices((1 << Devices::KINDS) - 1);

    /// Whether this one is chosen.
    #[must_use]
    pub const fn has(self, device: Devices) -> bool {
        self.0 & device.0 == device.0
    }

    /// Their types as 6000h lists them, in ascending order: bits 16 to 31 of 1000h in a device that is one of them only.
    pub fn types(self) -> impl Iterator<Item = u16> {
        TYPES.iter().filter(move |(device, _)| self.has(*device)).map(|(_, code)| *code)
    }

    /// Device type (1000h): the virtual device that the node is, or 0 in the upper half for several or none.
    #[must_use]
    #[inline(never)]
    pub fn device_type(self) -> u32 {
        let mut types = self.types();
        let only = match (types.next(), types.next()) {
            (Some(code), None) => code,
            _ => 0,
        };
        u32::from(only) << 16 | PROFILE
    }
}

/// The type of each virtual device.
static TYPES: [(Devices, u16); Devices::KINDS] = [
    (Devices::INPUT_PANEL, 0x0200),
    (Devices::OUTPUT_PANEL, 0x0300),
    (Devices::POSITION, 0x0600),
    (Devices::LOAD, 0x0A00),
];

/// The number of the profile.
pub const PROFILE: u32 = 417;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_device_type_names_the_only_virtual_device_or_none() {
        let types = [0, 1, 2, 4, 8, 3, 15].map(|chosen| Devices(chosen).device_type());
        assert_eq!(types, [0x1A1, 0x0600_01A1, 0x0A00_01A1, 0x0200_01A1, 0x0300_01A1, 0x1A1, 0x1A1]);
    }

    #[test]
    fn the_list_has_them_in_ascending_order() {
        assert_eq!(Devices::ALL.types().collect::<Vec<_>>(), [0x0200, 0x0300, 0x0600, 0x0A00]);
        assert_eq!(Devices(0).types().count(), 0);
    }
}
