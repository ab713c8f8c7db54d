//! How much of a long test runs: a part of it in every run, all of it with `cargo xtask test --thorough`.

/// Whether the tests are to do all that they can: `--thorough` sets THOROUGH=1.
#[must_use]
pub fn is_thorough() -> bool {
    std::env::var("THOROUGH").is_ok_and(|value| value == "1")
}

/// `all` in a thorough run, `part` in every other one.
#[must_use]
pub fn either<T>(part: T, all: T) -> T {
    if is_thorough() { all } else { part }
}
