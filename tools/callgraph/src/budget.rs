//! Budgets of values that depend on the compiler: sizes, stacks, instructions, panics.
//!
//! The project takes whatever `stable` is, because a pinned version would make rustup download. So the crate names the
//! compiler that the budgets were measured with. With this compiler a budget holds exactly. With another compiler a
//! budget holds within a stated width, because unchanged code takes more or less room then. The printed line names the
//! compiler of the image.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use object::{File, Object, ObjectSection};

/// The compiler that all budgets were measured with, as the image names it.
pub const MEASURED_WITH: &str = "1.96.0";

/// The largest permitted value of one quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Budget {
    /// The quantity that is limited, with its unit.
    pub what: &'static str,
    /// The largest value with [`MEASURED_WITH`].
    pub limit: u64,
    /// How far the value may exceed the limit with another compiler, in per cent. 0 where the limit does not depend on
    /// the compiler, for example the size of a flash.
    pub width: u64,
}

impl Budget {
    /// The largest value with this compiler.
    #[must_use]
    pub const fn limit_with(&self, compiler: &Compiler) -> u64 {
        if compiler.is_measured { self.limit } else { self.limit + self.limit * self.width / 100 }
    }

    /// Whether a value is within the budget. The line has the value, the budget and the compiler.
    ///
    /// # Errors
    /// The same line, when the value is over the budget. Also when the value is 0: then nothing was measured.
    pub fn check(&self, value: u64, compiler: &Compiler) -> Result<String> {
        let limit = self.limit_with(compiler);
        let line = format!("{}: {value}, budget {limit} with rustc {compiler}", self.what);
        ensure!(value > 0 && value <= limit, "over the budget: {line}");
        Ok(line)
    }
}

/// The compiler of an image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Compiler {
    version: String,
    is_measured: bool,
}

impl Compiler {
    /// A compiler of this version.
    #[must_use]
    pub fn new(version: &str) -> Compiler {
        Compiler { version: version.to_owned(), is_measured: version == MEASURED_WITH }
    }

    /// The compiler that has made an ELF file. Compilers leave their name and version in the file.
    ///
    /// # Errors
    /// The file cannot be read, or names no compiler.
    pub fn of(image: &Path) -> Result<Compiler> {
        let bytes = std::fs::read(image).with_context(|| format!("cannot read {}", image.display()))?;
        let elf = File::parse(&*bytes).with_context(|| format!("{} is no ELF file", image.display()))?;
        let comment =
            elf.section_by_name(".comment").context("the image does not name its compiler")?.data()?;
        let version = version(comment).context("the image names no rustc")?;
        Ok(Compiler::new(version))
    }

    /// The version of the compiler.
    #[must_use]
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Whether the budgets were measured with this compiler.
    #[must_use]
    pub const fn is_measured(&self) -> bool {
        self.is_measured
    }
}

impl std::fmt::Display for Compiler {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}", self.version)?;
        if self.is_measured { Ok(()) } else { write!(f, " (the budgets are those of {MEASURED_WITH})") }
    }
}

/// The number in `rustc version 1.96.0 (...)`.
fn version(comment: &[u8]) -> Option<&str> {
    let text = comment.split(|byte| *byte == 0).filter_map(|text| std::str::from_utf8(text).ok());
    text.filter_map(|text| text.strip_prefix("rustc version ")).find_map(|rest| rest.split(' ').next())
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUDGET: Budget = Budget { what: "flash, bytes", limit: 1000, width: 10 };

    #[test]
    fn a_budget_is_exact_with_its_compiler_and_has_a_width_with_another() {
        let (same, other) = (Compiler::new(MEASURED_WITH), Compiler::new("1.95.0"));
        assert!(BUDGET.check(1000, &same).is_ok() && BUDGET.check(1001, &same).is_err());
        assert!(BUDGET.check(1100, &other).is_ok() && BUDGET.check(1101, &other).is_err());
    }

    #[test]
    fn a_missing_measurement_is_within_no_budget() {
        assert!(BUDGET.check(0, &Compiler::new(MEASURED_WITH)).is_err());
    }

    #[test]
    fn the_line_names_the_compiler() {
        let line = BUDGET.check(5, &Compiler::new("1.99.0")).unwrap();
        assert_eq!(line, "flash, bytes: 5, budget 1100 with rustc 1.99.0 (the budgets are those of 1.96.0)");
    }

    #[test]
    fn the_version_stands_in_the_comment_of_the_image() {
        assert_eq!(version(b"Linker: LLD\0rustc version 1.96.0 (abc 2026)\0"), Some("1.96.0"));
        assert_eq!(version(b"GCC: 12\0"), None);
    }
}
