//! Secret keys: PKCS#8 in PEM, as OpenSSL writes them (`openssl genpkey -algorithm ed25519`).

use std::fs::OpenOptions;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use ed25519_dalek::pkcs8::spki::der::pem::LineEnding;
use ed25519_dalek::pkcs8::{DecodePrivateKey, EncodePrivateKey, KeypairBytes};
use ed25519_dalek::{Digest, Sha512, SigningKey, VerifyingKey};
use update::key::{DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY, Rank};

/// The source of the development key, so that anybody can make it again.
pub const DEVELOPMENT_SENTENCE: &str = "This development key is known to everybody and protects nothing.";

/// The path of the development key.
#[must_use]
pub fn development_path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("keys/DEVELOPMENT-KEY-KNOWN-TO-EVERYBODY.pem")
}

/// The development key: its seed is the first half of the SHA-512 of the sentence.
#[must_use]
pub fn development() -> SigningKey {
    let hash = Sha512::digest(DEVELOPMENT_SENTENCE);
    let mut seed = [0; 32];
    seed.iter_mut().zip(hash).for_each(|(to, byte)| *to = byte);
    SigningKey::from_bytes(&seed)
}

/// Whether a key is the development key.
#[must_use]
pub fn is_development(key: &SigningKey) -> bool {
    key.verifying_key().to_bytes() == DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY
}

/// A new key from the random numbers of the operating system.
///
/// # Errors
/// The operating system has no random numbers.
pub fn random() -> Result<SigningKey> {
    let mut seed = [0; 32];
    getrandom::fill(&mut seed).map_err(|error| anyhow::anyhow!("no random numbers: {error}"))?;
    Ok(SigningKey::from_bytes(&seed))
}

/// The key in a file.
///
/// # Errors
/// The file cannot be read or holds no Ed25519 key.
pub fn read(path: &Path) -> Result<SigningKey> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
    SigningKey::from_pkcs8_pem(&text)
        .with_context(|| format!("{} is no Ed25519 key in PKCS#8", path.display()))
}

/// The text of a key file, without the public half: OpenSSL does not read a file with both halves.
///
/// # Errors
/// The errors of the encoder.
pub fn pem(key: &SigningKey) -> Result<String> {
    let pair = KeypairBytes { secret_key: key.to_bytes(), public_key: None };
    Ok(pair.to_pkcs8_pem(LineEnding::LF).context("the key cannot be encoded")?.as_str().to_owned())
}

/// Writes a key to a new file that only its owner may read.
///
/// # Errors
/// The file exists already, or cannot be written.
pub fn write(key: &SigningKey, path: &Path) -> Result<()> {
    let mut options = OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let mut file = options.open(path).with_context(|| format!("cannot create {}", path.display()))?;
    file.write_all(pem(key)?.as_bytes()).with_context(|| format!("cannot write {}", path.display()))
}

/// The public half as the variable that a bootloader is built with, for a key of this rank: its name and 64 hexadecimal
/// digits.
#[must_use]
pub fn variable(key: &SigningKey, rank: Rank) -> String {
    let name = match rank {
        Rank::Release => "UPDATE_RELEASE_KEY",
        Rank::Root => "UPDATE_ROOT_KEY",
        Rank::Recovery => "UPDATE_RECOVERY_KEY",
    };
    format!("{name}={}", public_digits(key))
}

/// The public key with these 64 hexadecimal digits.
///
/// # Errors
/// The text is not a public key.
pub fn public(digits: &str) -> Result<VerifyingKey> {
    let mut bytes = [0; 32];
    hex::decode_to_slice(digits.trim(), &mut bytes).context("a public key has 64 hexadecimal digits")?;
    VerifyingKey::from_bytes(&bytes).context("no public key has these digits")
}

/// The public half as 64 hexadecimal digits.
#[must_use]
pub fn public_digits(key: &SigningKey) -> String {
    hex::encode(key.verifying_key().to_bytes())
}
