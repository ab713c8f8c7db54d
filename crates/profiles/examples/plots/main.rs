//! The plots and tables of the measurement chain for the documentation, computed with the chain itself: plots of input
//! against output for each filter, tables of settling times, delays and resolution, and plots of an encoder with
//! disturbed readings.
//!
//! `cargo xtask plots` runs it. The output is the same on every run, so that a test can compare it with the files in docs/.

mod encoder;
mod figure;
mod filters;
mod page;
mod resolution;
mod response;
mod stimulus;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use response::Filter;

/// A generated file, or a file with generated parts.
struct File {
    /// The path of the file.
    path: PathBuf,
    /// The whole text of the file.
    text: String,
}

/// All files: a plot for each filter, a plot for the encoder, and the page with its tables updated.
fn files() -> Vec<File> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).expect("the root of the workspace");
    let docs = root.join("docs");
    let plots = Filter::SHOWN.iter().map(|filter| File {
        path: docs.join("plots").join(format!("{}.svg", filter.file_name())),
        text: filters::plot(*filter),
    });
    let encoder = File { path: docs.join("plots").join("encoder.svg"), text: encoder::plot() };
    let path = docs.join("measuring.md");
    let old = std::fs::read_to_string(&path).expect("the page is there");
    plots.chain([encoder, File { path, text: page::updated(&old) }]).collect()
}

fn main() -> ExitCode {
    for file in files() {
        if let Err(error) = std::fs::write(&file.path, &file.text) {
            eprintln!("error: cannot write {}: {error}", file.path.display());
            return ExitCode::FAILURE;
        }
        println!("{}", file.path.display());
    }
    ExitCode::SUCCESS
}
