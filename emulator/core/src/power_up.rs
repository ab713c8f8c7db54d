//! The content of RAM at power-on: random, so that a program that relies on a value fails.

/// Generates the content of RAM for each power-on. Every power-on has another content, but repeated runs of a
/// simulation are equal.
pub(crate) struct PowerUp {
    seed: u64,
    content: Vec<u8>,
}

impl PowerUp {
    /// The generator of a machine. Machines with different seeds have different contents.
    pub(crate) fn new(seed: u64) -> PowerUp {
        PowerUp { seed, content: vec![] }
    }

    /// Generates the content of a RAM of `length` bytes at power-on.
    pub(crate) fn come(&mut self, length: usize) -> &[u8] {
        let words: Vec<u64> = (0..length.div_ceil(8)).map(|_| chip::random::next(&mut self.seed)).collect();
        self.content = words.into_iter().flat_map(u64::to_le_bytes).take(length).collect();
        &self.content
    }

    /// The content of RAM at the last power-on.
    pub(crate) fn content(&self) -> &[u8] {
        &self.content
    }
}
