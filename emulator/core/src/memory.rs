//! Flash and RAM: bytes that the CPU library and the emulator both access.

use std::ffi::c_void;
use std::ops::Range;
use std::ptr::NonNull;

use chip::BusFault;

use crate::model::Model;

/// The memory of a chip.
pub(crate) struct Memory {
    pub(crate) flash: Block,
    pub(crate) ram: Block,
    /// Addresses of pages of RAM from which code was fetched.
    pub(crate) code_in_ram: Vec<u32>,
    /// A new program has begun: code of the old program in RAM is probably no longer used.
    pub(crate) code_is_old: bool,
    /// The settings of the memory protection unit have changed since code was translated.
    pub(crate) protection_is_new: bool,
    /// Memory without execute rights was written: the code translated from there is outdated.
    pub(crate) code_is_stale: bool,
}

impl Memory {
    pub(crate) fn new(model: &Model) -> Memory {
        let (flash, ram) = (Block::new(model.flash.clone()), Block::new(model.ram.clone()));
        Memory {
            flash,
            ram,
            code_in_ram: Vec::new(),
            code_is_old: false,
            protection_is_new: false,
            code_is_stale: false,
        }
    }

    /// Reads bytes; `None` where there is no memory.
    pub(crate) fn read(&self, address: u32, bytes: &mut [u8]) -> Option<()> {
        let block = if address < self.ram.range.start { &self.flash } else { &self.ram };
        let from = block.place(address, bytes.len())?;
        // SAFETY: `place` has checked that all bytes lie in the block, and no other Rust reference to the block exists.
        unsafe { from.copy_to_nonoverlapping(bytes.as_mut_ptr(), bytes.len()) };
        Some(())
    }

    /// Writes bytes; `None` where there is no memory.
    pub(crate) fn write(&mut self, address: u32, bytes: &[u8]) -> Option<()> {
        let block = if address < self.ram.range.start { &self.flash } else { &self.ram };
        let to = block.place(address, bytes.len())?;
        // SAFETY: as in `read`.
        unsafe { to.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        Some(())
    }
}

impl chip::Memory for Memory {
    fn load(&self, address: u32, bytes: &mut [u8]) -> Result<(), BusFault> {
        self.read(address, bytes).ok_or(BusFault)
    }
}

/// One block of memory at a fixed address, which the CPU library uses.
pub(crate) struct Block {
    pub(crate) range: Range<u32>,
    bytes: NonNull<[u8]>,
}

impl Block {
    fn new(range: Range<u32>) -> Block {
        let bytes = vec![0_u8; range.len()].into_boxed_slice();
        Block { range, bytes: NonNull::from(Box::leak(bytes)) }
    }

    /// The address for the CPU library, which must not use it for longer than the block lives.
    pub(crate) fn pointer(&self) -> *mut c_void {
        self.bytes.as_ptr().cast()
    }

    fn place(&self, address: u32, length: usize) -> Option<*mut u8> {
        let offset = address.checked_sub(self.range.start)? as usize;
        let end = offset.checked_add(length)?;
        // SAFETY: the offset lies in the block.
        (end <= self.range.len()).then(|| unsafe { self.bytes.as_ptr().cast::<u8>().add(offset) })
    }
}

impl Drop for Block {
    fn drop(&mut self) {
        // SAFETY: the box was leaked in `new` and is freed here only.
        drop(unsafe { Box::from_raw(self.bytes.as_ptr()) });
    }
}
