//! The extent of long tests: a part in every run, everything with `cargo xtask test --thorough`.

/// Whether the tests run in full: `--thorough` sets THOROUGH=1.
#[must_use]
pub fn is_thorough() -> bool {
    std::env::var("THOROUGH").is_ok_and(|value| value == "1")
}

/// `all` in a thorough run, `part` otherwise.
#[must_use]
pub fn either<T>(part: T, all: T) -> T {
    if is_thorough() { all } else { part }
}
