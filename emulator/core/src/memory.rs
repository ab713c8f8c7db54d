//! The flash array and RAM: host memory that the CPU library maps and that the machine reads and writes directly.
//!
//! The one place of the crate with `unsafe`. The translated code of the CPU library reads and writes these bytes while
//! Rust holds no reference to them: all access goes through raw pointers out of `UnsafeCell`, and both sides run in
//! one thread (the engine is not `Send`).

use std::cell::UnsafeCell;
use std::ffi::c_void;
use std::ops::Range;

use chip::BusFault;

use crate::model::Model;

const PAGE: usize = 4096;

#[repr(C, align(4096))]
struct Page(UnsafeCell<[u8; PAGE]>);

/// One contiguous array.
pub(crate) struct Array {
    range: Range<u32>,
    pages: Box<[Page]>,
}

impl Array {
    fn new(range: Range<u32>) -> Array {
        let count = ((range.end - range.start) as usize).div_ceil(PAGE);
        Array { range, pages: (0..count).map(|_| Page(UnsafeCell::new([0; PAGE]))).collect() }
    }

    pub(crate) fn range(&self) -> Range<u32> {
        self.range.clone()
    }

    /// Where the bytes lie on the host, for the CPU library to map; valid as long as the array lives.
    pub(crate) fn pointer(&self) -> *mut c_void {
        UnsafeCell::raw_get(self.pages.as_ptr().cast::<UnsafeCell<u8>>()).cast()
    }

    /// The host address of `length` bytes at `address`, when all of them lie in the array.
    fn at(&self, address: u32, length: usize) -> Option<*mut u8> {
        let offset = address.checked_sub(self.range.start)? as usize;
        let size = (self.range.end - self.range.start) as usize;
        let inside = offset.checked_add(length).is_some_and(|end| end <= size);
        // SAFETY: offset is within the allocation, which is at least `size` bytes.
        inside.then(|| unsafe { self.pointer().cast::<u8>().add(offset) })
    }
}

/// All memory of the chip.
pub(crate) struct Memory {
    flash: Array,
    ram: Array,
}

impl Memory {
    pub(crate) fn new(model: &Model) -> Memory {
        Memory { flash: Array::new(model.flash.clone()), ram: Array::new(model.ram.clone()) }
    }

    pub(crate) fn flash(&self) -> &Array {
        &self.flash
    }

    pub(crate) fn ram(&self) -> &Array {
        &self.ram
    }

    fn at(&self, address: u32, length: usize) -> Result<*mut u8, BusFault> {
        self.flash.at(address, length).or_else(|| self.ram.at(address, length)).ok_or(BusFault)
    }

    /// Copies bytes out.
    pub(crate) fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        let source = self.at(address, bytes.len())?;
        // SAFETY: `at` checked the range; a `&mut` slice of the caller cannot overlap bytes nobody borrows.
        unsafe { source.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len()) };
        Ok(())
    }

    /// Copies bytes in, flash included.
    pub(crate) fn store(&self, address: u32, bytes: &[u8]) -> Result<(), BusFault> {
        let target = self.at(address, bytes.len())?;
        // SAFETY: as in `load`.
        unsafe { target.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        Ok(())
    }

    /// Sets a range to one value.
    pub(crate) fn fill(&self, range: &Range<u32>, byte: u8) -> Result<(), BusFault> {
        let length = (range.end - range.start) as usize;
        let target = self.at(range.start, length)?;
        // SAFETY: `at` checked the range.
        unsafe { target.write_bytes(byte, length) };
        Ok(())
    }

    /// The word at an address.
    pub(crate) fn word(&self, address: u32) -> Result<u32, BusFault> {
        let mut bytes = [0; 4];
        self.load(address, &mut bytes).map(|()| u32::from_le_bytes(bytes))
    }
}

impl chip::Memory for Memory {
    fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        Memory::load(self, address, bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn memory() -> Memory {
        let model =
            Model { flash: 0x0800_0000..0x0800_2000, ram: 0x2000_0000..0x2000_1000, ..Model::stm32f4(0) };
        Memory::new(&model)
    }

    #[test]
    fn stores_stay_inside() {
        let memory = memory();
        assert_eq!(memory.store(0x2000_0FFE, &[1, 2]), Ok(()));
        assert_eq!(memory.store(0x2000_0FFF, &[1, 2]), Err(BusFault));
        assert_eq!(memory.word(0x2000_0FFC).map(|word| word >> 16), Ok(0x0201));
    }

    #[test]
    fn a_fill_ends_where_it_should() {
        let memory = memory();
        assert_eq!(memory.fill(&(0x0800_0004..0x0800_0006), 0xAA), Ok(()));
        assert_eq!(memory.word(0x0800_0004), Ok(0x0000_AAAA));
        assert_eq!(memory.fill(&(0x0800_1FFF..0x0800_2001), 0), Err(BusFault));
    }
}
