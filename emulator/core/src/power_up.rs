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
        let words: Vec<u64> = (0..length.div_ceil(8)).map(|_| self.next()).collect();
        self.content = words.into_iter().flat_map(u64::to_le_bytes).take(length).collect();
        &self.content
    }

    /// The content of RAM at the last power-on.
    pub(crate) fn content(&self) -> &[u8] {
        &self.content
    }

    /// SplitMix64 (Steele, Lea and Flood 2014).
    fn next(&mut self) -> u64 {
        self.seed = self.seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.seed ^ self.seed >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ mixed >> 31
    }
}
