//! Signed images: a header and code in one file.

use anyhow::{Context, Result, ensure};
use ed25519_dalek::{Digest, Sha512, Signature, SigningKey, VerifyingKey};
use update::{CONTEXT, Description, HEADER_LEN, Header};

/// An image in the form of a download: header and code.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// The header.
    pub header: Header,
    /// The code, in the length that the header tells.
    pub code: Vec<u8>,
}

impl Image {
    /// Signs code.
    ///
    /// # Errors
    /// The code is empty or no whole number of words.
    pub fn sign(description: Description, code: Vec<u8>, key: &SigningKey) -> Result<Image> {
        let header = Header::describe(description, &code).context("code is a whole number of words")?;
        let signature = key.sign_prehashed(hash(&header, &code), Some(CONTEXT))?;
        Ok(Image { header: header.with_signature(signature.to_bytes()), code })
    }

    /// The bytes of the file.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        [&self.header.encode()[..], &self.code].concat()
    }

    /// Reads the image in a file and checks everything except its signature.
    ///
    /// # Errors
    /// The error in the image, in the words of 1F57h where a node would give the same error.
    pub fn read(bytes: &[u8]) -> Result<Image> {
        let (header, code) = bytes.split_first_chunk::<HEADER_LEN>().context("too short for a header")?;
        let header = Header::parse(header)?;
        let length = header.length() as usize;
        ensure!(code.len() == length, "{} bytes of code, and the header says {length}", code.len());
        let again = Header::describe(header.description(), code);
        ensure!(
            again.is_some_and(|again| again.code_crc() == header.code_crc()),
            "the CRC of the code is wrong"
        );
        Ok(Image { header, code: code.to_vec() })
    }

    /// Whether the image is signed with the secret half of this key.
    #[must_use]
    pub fn is_signed_by(&self, key: &VerifyingKey) -> bool {
        let signature = Signature::from_bytes(self.header.signature());
        key.verify_prehashed(hash(&self.header, &self.code), Some(CONTEXT), &signature).is_ok()
    }
}

fn hash(header: &Header, code: &[u8]) -> Sha512 {
    Sha512::new().chain_update(header.signed_part()).chain_update(code)
}
