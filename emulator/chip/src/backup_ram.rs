//! Backup SRAM: 4 KiB in the backup domain (RM0390 section 5.1.2, RM0090 section 5.1.2). PWR decides whether a program
//! may write and whether the content survives a loss of the main supply.

/// Size in bytes.
pub(crate) const SIZE: u32 = 4096;

/// Every byte after a loss of the supply: an arbitrary value, because a program must not count on the content of RAM.
const LOST: u8 = 0xA5;

#[derive(Clone)]
pub(crate) struct BackupRam {
    words: Vec<u32>,
}

impl Default for BackupRam {
    fn default() -> Self {
        Self { words: vec![u32::from_le_bytes([LOST; 4]); SIZE as usize / 4] }
    }
}

impl BackupRam {
    pub(crate) fn read(&self, offset: u32) -> Option<u32> {
        self.words.get(offset as usize / 4).copied()
    }

    pub(crate) fn write(&mut self, offset: u32, value: u32) -> Option<()> {
        *self.words.get_mut(offset as usize / 4)? = value;
        Some(())
    }

    /// Some cells lose their content: a bit of each third word, but not of the first one.
    pub(crate) fn decay(&mut self) {
        self.words.iter_mut().skip(1).step_by(3).for_each(|word| *word ^= 1 << 7);
    }

    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// Restores a kept content from the first byte on; bytes beyond the size are ignored.
    pub(crate) fn set_bytes(&mut self, bytes: &[u8]) {
        let (words, _) = bytes.as_chunks();
        self.words.iter_mut().zip(words).for_each(|(to, from)| *to = u32::from_le_bytes(*from));
    }
}
