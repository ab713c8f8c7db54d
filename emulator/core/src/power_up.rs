//! What RAM holds when the power comes: each bit comes up as it will, and a program that takes one for granted is wrong.

/// The content of RAM after power-on, another one each time: the same at every run of a simulation.
pub(crate) struct PowerUp {
    seed: u64,
    content: Vec<u8>,
}

impl PowerUp {
    /// Of a machine that had no power yet. Machines with different seeds come up differently.
    pub(crate) fn new(seed: u64) -> PowerUp {
        PowerUp { seed, content: vec![] }
    }

    /// The power comes to a RAM of so many bytes.
    pub(crate) fn come(&mut self, length: usize) -> &[u8] {
        let words: Vec<u64> = (0..length.div_ceil(8)).map(|_| self.next()).collect();
        self.content = words.into_iter().flat_map(u64::to_le_bytes).take(length).collect();
        &self.content
    }

    /// What RAM held when the power came the last time.
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
