//! Writes all files: `cargo xtask plots`.

use std::process::ExitCode;

fn main() -> ExitCode {
    for file in plots::files() {
        if let Err(error) = std::fs::write(&file.path, &file.text) {
            eprintln!("error: cannot write {}: {error}", file.path.display());
            return ExitCode::FAILURE;
        }
        println!("{}", file.path.display());
    }
    ExitCode::SUCCESS
}
