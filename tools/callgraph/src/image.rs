//! An ELF file for the Cortex-M: its functions, the bytes at an address, its vectors.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use addr2line::demangle_auto;
use anyhow::{Context, Result, anyhow, ensure};
use object::{File, Object, ObjectSection, ObjectSegment, ObjectSymbol, SymbolKind};

/// Bit 0 of the address of a function says that it is Thumb code.
const THUMB: u32 = 1;

/// A function of the image.
#[derive(Debug)]
pub(crate) struct Function {
    /// The path in the source; functions that were merged have the path of the first of them.
    pub(crate) name: String,
    pub(crate) start: u32,
    pub(crate) end: u32,
    /// The bytes of stack that the compiler has noted, if it has.
    pub(crate) noted: Option<u32>,
}

/// An ELF file, prepared for look-ups.
pub(crate) struct Image<'a> {
    file: File<'a>,
    /// The functions by their start address.
    functions: BTreeMap<u32, Function>,
    symbols: BTreeMap<&'a str, (u32, u32)>,
    /// The addresses where code (`$t`) and data within code (`$d`) begin (ELF for the Arm Architecture, 5.5.5).
    is_code: BTreeMap<u32, bool>,
}

impl<'a> Image<'a> {
    pub(crate) fn parse(bytes: &'a [u8]) -> Result<Image<'a>> {
        let file = File::parse(bytes)?;
        let mut image = Image {
            functions: BTreeMap::new(),
            symbols: BTreeMap::new(),
            is_code: BTreeMap::new(),
            file: File::parse(bytes)?,
        };
        image.take_symbols(&file)?;
        image.take_stack_sizes(&file)?;
        Ok(image)
    }

    fn take_symbols(&mut self, file: &File<'a>) -> Result<()> {
        let mut marks = BTreeSet::new();
        for symbol in file.symbols().filter(|symbol| !symbol.is_undefined()) {
            let Ok(name) = symbol.name() else { continue };
            let (address, size) = (u32::try_from(symbol.address())?, u32::try_from(symbol.size())?);
            match name.as_bytes() {
                [b'$', b't', ..] => _ = self.is_code.insert(address, true),
                [b'$', b'd', ..] => _ = self.is_code.insert(address, false),
                _ if symbol.kind() == SymbolKind::Text => self.add(name, address & !THUMB, size),
                _ => {}
            }
            marks.insert(address & !THUMB);
            self.symbols.insert(name, (address, size));
        }
        // A function in assembler has no size: it ends where the next symbol begins.
        for function in self.functions.values_mut().filter(|function| function.end == function.start) {
            let next = marks.range(function.start + 1..).next();
            function.end = *next.with_context(|| format!("{} has no end", function.name))?;
        }
        Ok(())
    }

    fn add(&mut self, name: &str, start: u32, size: u32) {
        let end = start + size;
        let function = self.functions.entry(start).or_insert_with(|| {
            let name = demangle_auto(name.into(), None).into_owned();
            Function { name, start, end, noted: None }
        });
        function.end = function.end.max(end);
    }

    /// Notes the stack sizes: pairs of an address and a ULEB128 (LLVM, "Emitting function stack size information").
    fn take_stack_sizes(&mut self, file: &File<'a>) -> Result<()> {
        let Some(section) = file.section_by_name(".stack_sizes") else { return Ok(()) };
        let mut rest = section.data()?;
        while let Some((address, more)) = rest.split_first_chunk() {
            let len = 1 + more.iter().take_while(|&&byte| byte & 0x80 != 0).count();
            let digits = more.get(..len).context("the last size of .stack_sizes is cut")?;
            let size = digits.iter().rev().fold(0, |size, digit| size << 7 | u32::from(digit & 0x7F));
            if let Some(function) = self.functions.get_mut(&(u32::from_le_bytes(*address) & !THUMB)) {
                function.noted = function.noted.max(Some(size));
            }
            rest = &more[len..];
        }
        Ok(())
    }

    pub(crate) fn functions(&self) -> impl Iterator<Item = &Function> {
        self.functions.values()
    }

    /// The function that contains this address, with or without bit 0.
    pub(crate) fn function_at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address & !THUMB).next_back()?;
        (function.end > address & !THUMB).then_some(function)
    }

    /// The function that a branch to this address enters.
    pub(crate) fn entered(&self, address: u32) -> Result<&Function> {
        self.function_at(address).with_context(|| format!("{address:#010x} is in no function"))
    }

    /// The function of this name.
    pub(crate) fn function(&self, name: &str) -> Result<&Function> {
        let found = self.symbols.get(name).and_then(|(address, _)| self.function_at(*address));
        found.ok_or_else(|| anyhow!("the image has no function {name}"))
    }

    /// The bytes that are loaded to these addresses.
    pub(crate) fn bytes(&self, start: u32, end: u32) -> Result<&'a [u8]> {
        let mut found = self
            .file
            .segments()
            .filter_map(|segment| segment.data_range(start.into(), (end - start).into()).ok()?);
        found.next().with_context(|| format!("nothing is loaded to {start:#010x}..{end:#010x}"))
    }

    pub(crate) fn word(&self, address: u32) -> Result<u32> {
        Ok(u32::from_le_bytes(self.bytes(address, address + 4)?.try_into()?))
    }

    /// The parts of a function that are code, without the constants between them.
    pub(crate) fn code(&self, function: &Function) -> Vec<(u32, u32)> {
        let mut is_code =
            self.is_code.range(..=function.start).next_back().is_none_or(|(_, &is_code)| is_code);
        let mut from = function.start;
        let mut parts = vec![];
        let changes =
            self.is_code.range(function.start + 1..function.end).map(|(&at, &is_code)| (at, is_code));
        for (at, next) in changes.chain([(function.end, false)]) {
            if is_code && from < at {
                parts.push((from, at));
            }
            (from, is_code) = (at, next);
        }
        parts
    }

    /// The functions that exceptions and interrupts start: the tables of vectors, without the reset.
    pub(crate) fn handlers(&self) -> Result<BTreeSet<u32>> {
        let mut handlers = BTreeSet::new();
        for (start, size) in [self.table("__EXCEPTIONS")?, self.interrupts()?] {
            ensure!(size > 0, "a table of vectors is empty");
            for address in (start..start + size).step_by(4) {
                let word = self.word(address)?;
                handlers.extend(self.function_at(word).map(|function| function.start));
            }
        }
        Ok(handlers)
    }

    /// The address and size of the table of interrupt vectors: the table of the device crate, or a shorter table that
    /// the bootloader's linker script makes.
    fn interrupts(&self) -> Result<(u32, u32)> {
        self.table("__INTERRUPTS").or_else(|_| {
            let start = self.symbol("__eexceptions")?;
            Ok((start, self.symbol("__evectors")?.saturating_sub(start)))
        })
    }

    fn table(&self, name: &str) -> Result<(u32, u32)> {
        self.symbols.get(name).copied().with_context(|| format!("the image has no {name}"))
    }

    /// The value of a symbol.
    pub(crate) fn symbol(&self, name: &str) -> Result<u32> {
        self.symbols
            .get(name)
            .map(|&(value, _)| value)
            .with_context(|| format!("the image has no symbol {name}"))
    }
}

/// Reads a file; an error names it.
pub(crate) fn read(path: &Path) -> Result<Vec<u8>> {
    std::fs::read(path)
        .with_context(|| format!("{}; `cargo xtask images --development` builds it", path.display()))
}
