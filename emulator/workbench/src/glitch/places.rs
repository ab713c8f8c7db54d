//! Functions of an image by address.

use anyhow::{Context, Result};
use object::{Object, ObjectSymbol};

/// The functions of an image.
pub struct Places(Vec<(u32, String)>);

impl Places {
    /// Reads the functions of an ELF file.
    ///
    /// # Errors
    /// The bytes are not an ELF file.
    pub fn of(elf: &[u8]) -> Result<Places> {
        let file = object::File::parse(elf).context("no ELF file")?;
        let functions = file.symbols().filter(|symbol| symbol.kind() == object::SymbolKind::Text);
        let mut all: Vec<(u32, String)> = functions
            .map(|symbol| {
                let name =
                    addr2line::demangle_auto(symbol.name().unwrap_or_default().into(), None).into_owned();
                (symbol.address() as u32 & !1, name)
            })
            .collect();
        all.sort();
        Ok(Places(all))
    }

    /// Function at an address, with the distance from its start.
    #[must_use]
    pub fn name(&self, address: u32) -> String {
        let after = self.0.partition_point(|(start, _)| *start <= address);
        match after.checked_sub(1).and_then(|at| self.0.get(at)) {
            Some((start, name)) => format!("{address:#010x} {name}+{:#x}", address - start),
            None => format!("{address:#010x}"),
        }
    }
}
