//! The content of the flash: the bootloader as it was linked, and the application behind a signed header.

use std::fmt;

use crate::sign::image::Image;
use crate::sign::{key, product};
use anyhow::{Context, Result, ensure};
use bsp::flash::sectors::FLASH;
use bsp::flash::update_layout::LAYOUT;
use ed25519_dalek::{SigningKey, VerifyingKey};
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, elf};
use update::key::{DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY, KEY_LEN};

/// Bytes and the address that they are written to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Part {
    /// The name of the part.
    pub what: &'static str,
    /// The address of the first byte.
    pub address: u32,
    /// The bytes.
    pub bytes: Vec<u8>,
}

/// The whole content that is written to the flash.
#[derive(Clone, Debug)]
pub struct Content {
    bootloader: Vec<Part>,
    image: Image,
    key: SigningKey,
    /// The root key and the recovery key of an owner.
    others: Vec<VerifyingKey>,
}

impl Content {
    /// Makes the content from the ELF files of both programs. The application is signed with `key`. `others` are the
    /// root key and the recovery key of an owner.
    ///
    /// # Errors
    /// One of the files is not for this board, or the bootloader does not trust these keys, or it trusts the development
    /// key beside a key of an owner.
    pub fn new(
        bootloader: &[u8],
        application: &[u8],
        key: SigningKey,
        others: Vec<VerifyingKey>,
    ) -> Result<Content> {
        let bootloader = segments(bootloader).context("the bootloader")?;
        let image = product::image(application, &key).context("the application")?;
        let content = Content { bootloader, image, key, others };
        for key in content.keys() {
            ensure!(
                content.trusts(&key.to_bytes()),
                "the bootloader was built with another key than {}",
                hex::encode(key.to_bytes())
            );
        }
        let is_mixed = !content.is_for_development() && content.trusts(&DEVELOPMENT_KEY_KNOWN_TO_EVERYBODY);
        ensure!(!is_mixed, "the bootloader is one for development: it trusts a published key");
        Ok(content)
    }

    fn is_for_development(&self) -> bool {
        key::is_development(&self.key)
    }

    fn keys(&self) -> impl Iterator<Item = VerifyingKey> {
        [self.key.verifying_key()].into_iter().chain(self.others.iter().copied())
    }

    /// The parts, by rising addresses.
    pub fn parts(&self) -> impl Iterator<Item = Part> {
        let address = FLASH + LAYOUT.application().start();
        let application = Part { what: "application", address, bytes: self.image.to_bytes() };
        self.bootloader.iter().cloned().chain([application])
    }

    /// Header and code of the application.
    #[must_use]
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// Whether the bootloader trusts a key: it contains the public keys that it trusts.
    fn trusts(&self, key: &[u8; KEY_LEN]) -> bool {
        self.bootloader.iter().any(|part| part.bytes.windows(KEY_LEN).any(|bytes| bytes == key))
    }
}

/// The output before anything is written: the kind of the bootloader, a line for each part with its range, its size and
/// its CRC-32 (ISO HDLC), then the image.
impl fmt::Display for Content {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.is_for_development() {
            writeln!(
                f,
                "DEVELOPMENT bootloader: it starts every program, signed or not; not for production"
            )?;
        } else {
            let keys: Vec<_> = self.keys().map(|key| hex::encode(key.to_bytes())).collect();
            writeln!(
                f,
                "bootloader of an owner: it starts only programs signed with the key of {}",
                keys.join(", which may be replaced by that of ")
            )?;
        }
        for Part { what, address, bytes } in self.parts() {
            let (length, crc) = (bytes.len(), storage::checksum::of(&bytes));
            let end = address as usize + length;
            writeln!(f, "{what:<12}{address:#010x}..{end:#010x}  {length:>6} bytes, CRC-32 {crc:#010x}")?;
        }
        let about = self.image.header.description();
        writeln!(f, "{:<12}{}, security counter {}", "version", about.version, about.counter)?;
        let digits = key::public_digits(&self.key);
        let whose = if self.is_for_development() {
            " (the development key, published in the repository)"
        } else {
            ""
        };
        write!(f, "{:<12}{digits}{whose}", "public key")
    }
}

/// The parts of an ELF file that are loaded into the flash.
fn segments(file: &[u8]) -> Result<Vec<Part>> {
    let elf = ElfFile32::<Endianness>::parse(file).context("a damaged ELF file, or none of 32 bits")?;
    let mut parts = Vec::new();
    for segment in elf.elf_program_headers() {
        let address = segment.p_paddr(Endianness::Little);
        let bytes =
            segment.data(Endianness::Little, file).ok().context("a segment that is not in the file")?;
        if segment.p_type(Endianness::Little) == elf::PT_LOAD && !bytes.is_empty() {
            let room = FLASH..FLASH + LAYOUT.application().start();
            ensure!(
                room.contains(&address),
                "{} bytes at {address:#010x} are no place for a bootloader",
                bytes.len()
            );
            parts.push(Part { what: "bootloader", address, bytes: bytes.to_vec() });
        }
    }
    ensure!(!parts.is_empty(), "nothing goes into flash");
    parts.sort_by_key(|part| part.address);
    Ok(parts)
}
