//! The authorisation of an update: the answer to the challenge of a node (2003h of nodes of this project).

use std::str::FromStr;

use ::update::response;

/// The key that the bootloader of the node was built with (`UPDATE_AUTHORISATION_KEY`).
#[derive(Clone, Copy)]
pub struct AuthorisationKey([u8; 32]);

impl AuthorisationKey {
    /// The expected response of a node with this serial number to a challenge.
    #[must_use]
    pub fn response(&self, challenge: [u8; 8], serial_number: u32) -> [u8; 8] {
        response(&self.0, challenge, serial_number)
    }
}

impl FromStr for AuthorisationKey {
    type Err = &'static str;

    fn from_str(text: &str) -> Result<AuthorisationKey, &'static str> {
        let mut key = [0; 32];
        let is_key = hex::decode_to_slice(text.trim(), &mut key).is_ok();
        is_key.then_some(AuthorisationKey(key)).ok_or("the key is not 64 hexadecimal digits")
    }
}

/// Hides the key, so that no log can contain it.
impl std::fmt::Debug for AuthorisationKey {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str("AuthorisationKey")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_is_64_digits_with_the_blanks_of_an_editor() {
        let digits = "0F".repeat(32);
        assert_eq!(format!("{digits}\n").parse::<AuthorisationKey>().unwrap().0, [0x0F; 32]);
        for wrong in ["", &digits[1..], &format!("{digits}00"), &digits.replace('F', "G"), "\u{fc}"] {
            assert!(wrong.parse::<AuthorisationKey>().is_err(), "{wrong}");
        }
    }
}
