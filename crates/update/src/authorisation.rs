//! Permission to change the program, for a bootloader with an authorisation key: a client must answer the challenge of
//! this start (2003h).
//!
//! The bootloader makes a [`Pair`] of challenge and response at each start. The application gets the pair and never the
//! key, so an answer is compared, not computed. The next start has another challenge, so a response recorded from the
//! bus is useless then.

use core::fmt;

use sha2::{Digest, Sha512};

use crate::key::{KEY_LEN, key};

/// Bytes of a challenge, and of the response.
pub const RESPONSE_LEN: usize = 8;

/// The key of this bootloader: 64 hexadecimal digits in the variable `UPDATE_AUTHORISATION_KEY` when the bootloader is
/// built. Without the variable anybody may change the program.
pub const AUTHORISATION_KEY: Option<[u8; KEY_LEN]> = match option_env!("UPDATE_AUTHORISATION_KEY") {
    Some(digits) => Some(key(digits.as_bytes())),
    None => None,
};

/// The response of the holder of the key to the challenge of the node with this serial number (1018h:4): the first
/// eight bytes of HMAC-SHA-512 (RFC 2104) over the challenge and the serial number, both in the byte order of SDO, low
/// byte first.
#[must_use]
pub fn response(
    key: &[u8; KEY_LEN],
    challenge: [u8; RESPONSE_LEN],
    serial_number: u32,
) -> [u8; RESPONSE_LEN] {
    let [a, b] = words(challenge);
    bytes(code(key, &[a, b, serial_number]))
}

/// The first two words of the HMAC over these words, low byte first. Computed here because the crate `hmac` needs more
/// of the bootloader's flash than is left; the tests compare with that crate.
#[inline(never)]
fn code(key: &[u8; KEY_LEN], message: &[u32]) -> [u32; 2] {
    let mut inner = keyed(key, 0x36);
    for word in message {
        inner.update(word.to_le_bytes());
    }
    let mut outer = keyed(key, 0x5C);
    outer.update(inner.finalize());
    words(outer.finalize().first_chunk().copied().unwrap_or_default())
}

/// A hash that begins with the key, padded to a block, with each byte combined with the pad (RFC 2104, 2).
fn keyed(key: &[u8; KEY_LEN], pad: u8) -> Sha512 {
    let mut block = [pad; 128];
    block.iter_mut().zip(key).for_each(|(to, from)| *to ^= from);
    Sha512::new_with_prefix(block)
}

#[allow(clippy::many_single_char_names)] // Eight bytes.
fn words([a, b, c, d, e, f, g, h]: [u8; RESPONSE_LEN]) -> [u32; 2] {
    [u32::from_le_bytes([a, b, c, d]), u32::from_le_bytes([e, f, g, h])]
}

fn bytes([low, high]: [u32; 2]) -> [u8; RESPONSE_LEN] {
    (u64::from(low) | u64::from(high) << 32).to_le_bytes()
}

/// The challenge of one start, and its response.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Pair {
    challenge: [u32; 2],
    response: [u32; 2],
}

impl Pair {
    /// The pair of a start. `noise` makes the challenge different at each start; no observer can predict the challenge from
    /// the noise without the key.
    #[must_use]
    pub fn new(key: &[u8; KEY_LEN], noise: &[u32], serial_number: u32) -> Pair {
        let challenge = code(key, noise);
        let [a, b] = challenge;
        Pair { challenge, response: code(key, &[a, b, serial_number]) }
    }

    /// The words kept in RAM: challenge, then response, low word first.
    #[must_use]
    pub fn words(&self) -> [u32; 4] {
        let ([a, b], [c, d]) = (self.challenge, self.response);
        [a, b, c, d]
    }

    /// The pair in the words kept in RAM.
    #[must_use]
    pub fn from_words([a, b, c, d]: [u32; 4]) -> Pair {
        Pair { challenge: [a, b], response: [c, d] }
    }
}

/// Whether the program may be changed, for 2003h.
#[derive(Clone, Copy, Default)]
pub struct Authorisation {
    /// `None` if no key is set, so that anybody may change the program.
    pair: Option<Pair>,
    is_answered: bool,
}

impl Authorisation {
    /// The authorisation of a start with this pair. `is_answered`: the challenge of the previous start was answered,
    /// and that start requested this one.
    #[must_use]
    pub fn new(pair: Option<Pair>, is_answered: bool) -> Authorisation {
        Authorisation { pair, is_answered }
    }

    /// 2003h:1: 0 no key is set, 1 closed, 2 open until the next start.
    #[must_use]
    pub fn state(&self) -> u8 {
        match (self.pair, self.is_answered) {
            (None, _) => 0,
            (Some(_), false) => 1,
            (Some(_), true) => 2,
        }
    }

    /// 2003h:2: the challenge of this start; zeros if no key is set.
    #[must_use]
    pub fn challenge(&self) -> [u8; RESPONSE_LEN] {
        bytes(self.pair.map_or([0; 2], |pair| pair.challenge))
    }

    /// Handles a write to 2003h:3; returns whether the bytes are the response.
    pub fn answer(&mut self, bytes: [u8; RESPONSE_LEN]) -> bool {
        let [low, high] = words(bytes);
        // All bytes are always compared, so the time reveals nothing about a wrong response.
        let is_right = self.pair.is_some_and(|Pair { response: [a, b], .. }| (a ^ low) | (b ^ high) == 0);
        self.is_answered |= is_right;
        is_right
    }

    /// Whether a key is set.
    #[must_use]
    pub fn asks(&self) -> bool {
        self.pair.is_some()
    }

    /// Whether 1F50h, 1F51h and 2002h take commands.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.pair.is_none() || self.is_answered
    }
}

/// Keeps the response out of logs.
impl fmt::Debug for Authorisation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Authorisation").field("state", &self.state()).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use hmac::{Hmac, KeyInit, Mac};

    use super::*;

    const KEY: [u8; KEY_LEN] = [0x42; KEY_LEN];
    const SERIAL: u32 = 0x1234_5678;

    /// Computed in Python: `hmac.new(bytes([0x42] * 32), bytes(range(8)) + bytes.fromhex("78563412"),
    /// "sha512").digest()[:8]`.
    #[test]
    fn the_response_is_that_of_another_implementation() {
        let challenge = [0, 1, 2, 3, 4, 5, 6, 7];
        assert_eq!(response(&KEY, challenge, SERIAL), [0x2E, 0xF1, 0x23, 0xDF, 0x4B, 0x14, 0x6A, 0x88]);
    }

    #[test]
    fn it_is_the_hmac_of_a_library() {
        for length in [0, 1, 3, 64, 300] {
            let words: std::vec::Vec<u32> = (0..length).collect();
            let mut library: Hmac<Sha512> = Hmac::new_from_slice(&KEY).unwrap();
            for word in &words {
                library.update(&word.to_le_bytes());
            }
            assert_eq!(bytes(code(&KEY, &words)), library.finalize().into_bytes()[..RESPONSE_LEN]);
        }
    }

    #[test]
    fn only_the_response_of_this_start_and_this_node_opens() {
        let pair = Pair::new(&KEY, &[1, 2, 3], SERIAL);
        let mut authorisation = Authorisation::new(Some(pair), false);
        assert_eq!((authorisation.state(), authorisation.is_open()), (1, false));
        let challenge = authorisation.challenge();
        let earlier = Pair::new(&KEY, &[1, 2, 2], SERIAL);
        let wrong = [
            [0; RESPONSE_LEN],
            challenge,
            bytes(earlier.response),
            response(&KEY, challenge, SERIAL + 1),
            response(&[0x43; KEY_LEN], challenge, SERIAL),
        ];
        for wrong in wrong {
            assert!(!authorisation.answer(wrong) && !authorisation.is_open());
        }
        assert!(authorisation.answer(response(&KEY, challenge, SERIAL)));
        assert_eq!((authorisation.state(), authorisation.is_open()), (2, true));
        assert!(!authorisation.answer([0; RESPONSE_LEN]));
        assert!(authorisation.is_open(), "a wrong answer closes nothing: anybody could give one");
    }

    #[test]
    fn every_bit_of_the_response_counts() {
        let pair = Pair::new(&KEY, &[], SERIAL);
        for bit in 0..64 {
            let wrong = (u64::from_le_bytes(bytes(pair.response)) ^ 1 << bit).to_le_bytes();
            assert!(!Authorisation::new(Some(pair), false).answer(wrong), "bit {bit}");
        }
    }

    #[test]
    fn every_word_of_the_noise_and_the_key_make_another_challenge() {
        let first = Pair::new(&KEY, &[7; 64], SERIAL);
        for at in 0..64 {
            let mut noise = [7; 64];
            noise[at] ^= 1 << (at % 32);
            assert_ne!(Pair::new(&KEY, &noise, SERIAL).challenge, first.challenge);
        }
        assert_ne!(Pair::new(&[0x43; KEY_LEN], &[7; 64], SERIAL).challenge, first.challenge);
    }

    #[test]
    fn without_a_key_everybody_may() {
        let mut authorisation = Authorisation::default();
        assert_eq!((authorisation.state(), authorisation.is_open()), (0, true));
        assert_eq!(authorisation.challenge(), [0; RESPONSE_LEN]);
        assert!(!authorisation.answer([0; RESPONSE_LEN]));
    }

    #[test]
    fn the_pair_in_ram_survives_a_reset() {
        let pair = Pair::new(&KEY, &[1], SERIAL);
        assert!(Pair::from_words(pair.words()) == pair);
    }
}
