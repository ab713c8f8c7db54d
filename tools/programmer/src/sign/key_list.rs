//! Key lists: the certificates in the header of an image, and in a file from which images get them.

use anyhow::{Context, Result, ensure};
use ed25519_dalek::{Digest, Sha512, SigningKey, VerifyingKey};
use update::key::{Certificate, KEYS_CONTEXT, KeyList, RELEASES, root_generation};

/// A certificate of a key, signed with the key of the rank above.
///
/// # Errors
/// The errors of the signature.
fn certify(generation: u32, counter: u32, key: &VerifyingKey, by: &SigningKey) -> Result<Certificate> {
    let certificate = Certificate { generation, counter, key: key.to_bytes(), signature: [0; 64] };
    let hash = Sha512::new().chain_update(certificate.signed_part());
    let signature = by.sign_prehashed(hash, Some(KEYS_CONTEXT))?;
    Ok(Certificate { signature: signature.to_bytes(), ..certificate })
}

/// A list in which the root key `by` certifies a release key: the one with this number, 1 to 15, of its root key, or 0 to 15
/// of a root key that is in `before`. From `counter` on the release key raises the security counter.
///
/// # Errors
/// The number is not that of a release key, or another root key is in `before`.
pub fn with_release(
    before: KeyList,
    key: &VerifyingKey,
    number: u32,
    counter: u32,
    by: &SigningKey,
) -> Result<KeyList> {
    let root = before.root.map_or(0, |root| root.generation);
    let generation = root + number;
    ensure!(generation != 0, "number 0 is the release key of the bootloader");
    ensure!(
        root_generation(generation) == root,
        "a root key has the release keys up to number {}",
        RELEASES - 1
    );
    if let Some(root) = before.root {
        ensure!(root.key == by.verifying_key().to_bytes(), "the list before is that of another root key");
    }
    Ok(KeyList { release: Some(certify(generation, counter, key, by)?), ..before })
}

/// A list in which the recovery key `by` certifies the root key with this number, 1 to 3. It has no release key yet.
///
/// # Errors
/// The number is not that of a root key.
pub fn with_root(key: &VerifyingKey, number: u32, by: &SigningKey) -> Result<KeyList> {
    let highest = update::key::GENERATIONS / RELEASES - 1;
    ensure!((1..=highest).contains(&number), "a root key has a number from 1 to {highest}");
    Ok(KeyList { root: Some(certify(number * RELEASES, 0, key, by)?), release: None })
}

/// Reads the list in a file.
///
/// # Errors
/// The file has another length.
pub fn read(bytes: &[u8]) -> Result<KeyList> {
    Ok(KeyList::from_bytes(
        bytes.try_into().ok().with_context(|| format!("a key list has {} bytes", KeyList::LEN))?,
    ))
}
