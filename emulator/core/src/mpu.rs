//! The memory protection unit (ARMv7-M, B3.5), page by page of a kilobyte and with the rights of privileged code. A region
//! that is finer, or that tells privileged data accesses from others, is reported, so that no program relies on a missing
//! protection.

use unicorn_engine::Prot;

/// Number of regions.
const REGIONS: usize = 8;

/// RBAR: the lowest bits select the region to write.
const VALID: u32 = 1 << 4;
/// Bits of MPU_CTRL.
const ENABLE: u32 = 1;
const PRIVDEFENA: u32 = 1 << 2;
/// Fields of RASR.
const XN: u32 = 1 << 28;
const ACCESS: u32 = 0b111 << 24;
const NOBODY: u32 = 0;
const FULL_ACCESS: u32 = 0b011 << 24;
const PRIVILEGED_READ_ONLY: u32 = 0b101 << 24;
const READ_ONLY: u32 = 0b110 << 24;
const READ_ONLY_TOO: u32 = 0b111 << 24;
/// The size of a page of the CPU library, as an exponent of 2.
const PAGE: u32 = 10;
/// The begin of the system space.
const SYSTEM: u32 = 0xE000_0000;
/// The size of the smallest region with sub-regions, 256 bytes, as an exponent of 2.
const LEAST_DIVIDED: u32 = 8;

/// The registers.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Mpu {
    control: u32,
    number: u32,
    regions: [Region; REGIONS],
}

#[derive(Clone, Copy, Debug, Default)]
struct Region {
    base: u32,
    attributes: u32,
}

impl Region {
    /// Whether the region applies to an address.
    fn covers(self, address: u32) -> bool {
        let exponent = (self.attributes >> 1 & 0x1F) + 1;
        let mask = 1_u64.checked_shl(exponent).map_or(u64::MAX, |size| size - 1);
        let offset = u64::from(address) & mask;
        let is_inside = u64::from(address) & !mask == u64::from(self.base) & !mask;
        let is_off = exponent >= LEAST_DIVIDED && self.attributes >> 8 & 1 << (offset >> (exponent - 3)) != 0;
        self.attributes & 1 != 0 && is_inside && !is_off
    }
}

impl Mpu {
    /// A register, by its distance from MPU_TYPE; `None` for an unknown register.
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        let region = self.regions[self.number as usize];
        Some(match offset {
            0x00 => (REGIONS as u32) << 8,
            0x04 => self.control,
            0x08 => self.number,
            0x0C | 0x14 | 0x1C | 0x24 => region.base | self.number,
            0x10 | 0x18 | 0x20 | 0x28 => region.attributes,
            _ => return None,
        })
    }

    /// `None` for an unknown register.
    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        match offset {
            0x00 => {}
            // HFNMIENA matters only to data, and to handlers in a region without execute rights.
            0x04 => self.control = value & (ENABLE | PRIVDEFENA),
            0x08 => self.number = value & 7,
            0x0C | 0x14 | 0x1C | 0x24 => {
                if value & VALID != 0 {
                    self.number = value & 7;
                }
                self.regions[self.number as usize].base = value & !0x1F;
            }
            0x10 | 0x18 | 0x20 | 0x28 => self.regions[self.number as usize].attributes = value,
            _ => return None,
        }
        Some(())
    }

    /// The property of the region written last that is not modelled.
    pub(crate) fn not_modelled(&self) -> Option<&'static str> {
        let region = self.regions[self.number as usize];
        let exponent = (region.attributes >> 1 & 0x1F) + 1;
        let is_divided = region.attributes & 0xFF00 != 0;
        let finest = if is_divided { exponent.saturating_sub(3) } else { exponent };
        let access = region.attributes & ACCESS;
        let is_for_all = matches!(access, NOBODY | READ_ONLY | READ_ONLY_TOO);
        if region.attributes & 1 == 0 || access == FULL_ACCESS {
            None
        } else if finest < PAGE {
            Some("a region of less than a kilobyte that protects data")
        } else {
            (!is_for_all).then_some("a region that protects data from unprivileged code")
        }
    }

    /// The rights of data accesses by privileged code to the page of an address. The unit does not protect the system
    /// space.
    pub(crate) fn data_rights(&self, address: u32) -> Prot {
        let all = Prot::READ | Prot::WRITE;
        if self.control & ENABLE == 0 || address >= SYSTEM {
            return all;
        }
        let region = self.regions.iter().rev().find(|region| region.covers(address));
        match region.map(|region| region.attributes & ACCESS) {
            None if self.control & PRIVDEFENA != 0 => all,
            None | Some(NOBODY) => Prot::NONE,
            Some(PRIVILEGED_READ_ONLY | READ_ONLY | READ_ONLY_TOO) => Prot::READ,
            _ => all,
        }
    }

    /// Whether an instruction may be fetched from an address. The region with the highest number that covers the
    /// address decides. Without such a region the default map decides, if the program keeps it enabled: flash and RAM
    /// may hold code (B3.5.1).
    pub(crate) fn allows_code(&self, address: u32) -> bool {
        if self.control & ENABLE == 0 {
            return true;
        }
        let region = self.regions.iter().rev().find(|region| region.covers(address));
        region.map_or(self.control & PRIVDEFENA != 0, |region| region.attributes & XN == 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A setting that forbids code in a gigabyte except in the middle of 64 KiB of RAM.
    fn confined() -> Mpu {
        let mut mpu = Mpu::default();
        mpu.write(0x0C, VALID).unwrap();
        mpu.write(0x10, XN | FULL_ACCESS | 29 << 1 | 1).unwrap();
        mpu.write(0x0C, 0x2000_0000 | VALID | 1).unwrap();
        mpu.write(0x10, FULL_ACCESS | 0b1000_0111 << 8 | 15 << 1 | 1).unwrap();
        mpu
    }

    #[test]
    fn the_region_with_the_highest_number_decides() {
        let mut mpu = confined();
        assert!(mpu.allows_code(0x0800_0000), "the unit is off");
        mpu.write(0x04, ENABLE | PRIVDEFENA).unwrap();
        let allowed = [0x2000_6000, 0x2000_DFFF, 0x4000_0000];
        let refused = [0, 0x0800_0000, 0x1FFF_FFFF, 0x2000_0000, 0x2000_5FFF, 0x2000_E000, 0x2001_0000];
        assert!(allowed.into_iter().all(|address| mpu.allows_code(address)));
        assert!(!refused.into_iter().any(|address| mpu.allows_code(address)));
    }

    #[test]
    fn without_the_default_map_there_is_code_in_regions_only() {
        let mut mpu = confined();
        mpu.write(0x04, ENABLE).unwrap();
        assert!(mpu.allows_code(0x2000_6000) && !mpu.allows_code(0x4000_0000));
    }

    #[test]
    fn data_is_protected_by_the_page() {
        let mut mpu = Mpu::default();
        let all = Prot::READ | Prot::WRITE;
        let set = |mpu: &mut Mpu, address: u32, access: u32, exponent: u32| {
            mpu.write(0x0C, address | VALID).unwrap();
            mpu.write(0x10, access << 24 | (exponent - 1) << 1 | 1).unwrap();
        };
        set(&mut mpu, 0x2000_0400, 0, 10);
        assert_eq!((mpu.data_rights(0x2000_0400), mpu.not_modelled()), (all, None), "the unit is off");
        mpu.write(0x04, ENABLE | PRIVDEFENA).unwrap();
        assert_eq!(mpu.data_rights(0x2000_0400), Prot::NONE);
        assert_eq!((mpu.data_rights(0x2000_03FF), mpu.data_rights(0x2000_0800)), (all, all));
        set(&mut mpu, 0x2000_0400, 0b110, 10);
        assert_eq!(mpu.data_rights(0x2000_0400), Prot::READ);
        set(&mut mpu, 0x2000_0400, 0, 5);
        assert!(mpu.not_modelled().unwrap().contains("less than a kilobyte"));
        set(&mut mpu, 0x2000_0400, 0b001, 10);
        assert!(mpu.not_modelled().unwrap().contains("unprivileged"));
        mpu.write(0x04, ENABLE).unwrap();
        assert_eq!((mpu.data_rights(0x4000_0000), mpu.data_rights(0xE000_E000)), (Prot::NONE, all));
    }

    #[test]
    fn registers_read_back() {
        let mut mpu = confined();
        assert_eq!(mpu.read(0x00), Some(0x800));
        assert_eq!((mpu.read(0x08), mpu.read(0x0C)), (Some(1), Some(0x2000_0001)));
        mpu.write(0x08, 0).unwrap();
        assert_eq!(mpu.read(0x10), Some(XN | FULL_ACCESS | 29 << 1 | 1));
        assert_eq!((mpu.write(0x2C, 0), mpu.read(0x2C)), (None, None));
    }
}
