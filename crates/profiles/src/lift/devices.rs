//! The virtual devices of a node. One object (2305h) chooses them; a node as delivered has none.

/// A set of virtual devices, one bit for each.
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
    /// Number of kinds of virtual devices.
    pub const KINDS: usize = 4;
    /// All kinds.
    pub const ALL: Devices = Devices((1 << Devices::KINDS) - 1);

    /// Whether `device` is in the set.
    #[must_use]
    pub const fn has(self, device: Devices) -> bool {
        self.0 & device.0 == device.0
    }

    /// The types as listed in 6000h, in the order of the bits and followed by zeros, and their number. The type equals
    /// bits 16 to 31 of 1000h in a device with one virtual device only.
    #[must_use]
    #[inline(never)] // This crate is compiled for speed, and the choice is not urgent.
    pub fn types(self) -> ([u16; Devices::KINDS], usize) {
        let (mut types, mut count) = ([0; Devices::KINDS], 0);
        for (bit, code) in [0x0600, 0x0A00, 0x0200, 0x0300].into_iter().enumerate() {
            if let Some(place) = types.get_mut(count).filter(|_| self.0 >> bit & 1 != 0) {
                *place = code;
                count += 1;
            }
        }
        (types, count)
    }

    /// Device type (1000h): the type of the only virtual device in the upper half, or 0 for several or none.
    #[must_use]
    pub fn device_type(self) -> u32 {
        let ([first, ..], count) = self.types();
        PROFILE | if count == 1 { u32::from(first) << 16 } else { 0 }
    }
}

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
        assert_eq!(Devices::ALL.types(), ([0x0600, 0x0A00, 0x0200, 0x0300], 4));
        assert_eq!(Devices(0b1010).types(), ([0x0A00, 0x0300, 0, 0], 2));
        assert_eq!(Devices(0).types(), ([0; 4], 0));
    }
}
