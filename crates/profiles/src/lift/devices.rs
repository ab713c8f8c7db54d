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

    /// Their types as 6000h lists them, in the order of their bits: bits 16 to 31 of 1000h in a device that is one of them only.
    pub fn types(self) -> impl Iterator<Item = u16> {
        let mut rest = self.0 & Devices::ALL.0;
        core::iter::from_fn(move || {
            let place = (rest != 0).then_some(rest.trailing_zeros())?;
            rest &= rest - 1;
            Some(u16::from_be_bytes([CODES.to_le_bytes()[place as usize & 3], 0]))
        })
    }

    /// Device type (1000h): the virtual device that the node is, or 0 in the upper half for several or none.
    #[must_use]
    pub fn device_type(self) -> u32 {
        let is_one = (self.0 & Devices::ALL.0).count_ones() == 1;
        let code = self.types().next().filter(|_| is_one).unwrap_or(0);
        u32::from(code) << 16 | PROFILE
    }
}

/// The upper bytes of the types, in the order of the bits: car position, load measuring, input panel, output panel.
const CODES: u32 = 0x0302_0A06;

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
    fn the_list_has_them_in_the_order_of_the_bits() {
        assert_eq!(Devices::ALL.types().collect::<Vec<_>>(), [0x0600, 0x0A00, 0x0200, 0x0300]);
        assert_eq!(Devices(0).types().count(), 0);
    }
}
