//! The start of `cargo xtask`, `cargo sim` and `cargo nodectl`. This program compiles in a second. If something is missing that only the
//! user can install, it prints the one command; otherwise it starts xtask.

use std::path::Path;
use std::process::{Command, ExitCode};

use start::needs::{self, Need};

fn main() -> ExitCode {
    let arguments: Vec<_> = std::env::args_os().skip(1).collect();
    let words: Vec<&str> = arguments.iter().filter_map(|argument| argument.to_str()).collect();
    if let Err(missing) = start::check(&start::missing(needs_of(&words))) {
        eprintln!("error: {missing}");
        return ExitCode::from(2);
    }
    let mut xtask = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    let root =
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the crate lies in the workspace");
    xtask.args(["run", "--quiet", "--profile", "sim", "--package", "xtask", "--manifest-path"]);
    xtask.arg(root.join("Cargo.toml")).arg("--").args(arguments);
    start::become_program(&mut xtask).unwrap_or_else(|error| {
        eprintln!("error: cannot start cargo: {error}");
        ExitCode::from(2)
    })
}

/// The certain needs of a command. Xtask checks the needs that depend on flags, or that only xtask can find out.
fn needs_of(words: &[&str]) -> &'static [Need] {
    let is_help = words.iter().any(|word| matches!(*word, "--help" | "-h" | "help" | "--dry-run"));
    match words.first() {
        _ if is_help => &[],
        Some(&"sim") => needs::SIM,
        Some(&"test") if words.contains(&"--thorough") => needs::THOROUGH,
        Some(&"test" | &"setup") => needs::TEST,
        Some(&"images") => needs::IMAGES,
        Some(&"pictures") => needs::PICTURES,
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_has_its_needs() {
        assert_eq!(needs_of(&["sim", "--for", "5"]), needs::SIM);
        assert_eq!(needs_of(&["test", "--only", "eds"]), needs::TEST);
        assert_eq!(needs_of(&["test", "--thorough"]), needs::THOROUGH);
        assert_eq!(needs_of(&["flash"]), []);
        assert_eq!(needs_of(&[]), []);
        assert_eq!(needs_of(&["sim", "--help"]), []);
        assert_eq!(needs_of(&["setup", "--dry-run"]), []);
    }
}
