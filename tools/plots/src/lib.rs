//! The plots and tables of the measurement chain for the documentation, computed with the chain itself: plots of input
//! against output for each filter, tables of settling times, delays and resolution, and plots of an encoder with
//! disturbed readings.
//!
//! The output is the same on every run, so that a test can compare it with the files in docs/.

mod encoder;
mod figure;
mod filters;
mod page;
mod resolution;
mod response;
mod stimulus;

pub use encoder::{Disturbance, Sample, turn};
pub use resolution::{Resolution, resolution};
pub use response::{Filter, Trace, delay, settling, trace};
pub use stimulus::Stimulus;

use std::path::{Path, PathBuf};

/// A generated file, or a file with generated parts.
#[derive(Clone, Debug)]
pub struct File {
    /// The path of the file.
    pub path: PathBuf,
    /// The whole text of the file.
    pub text: String,
}

/// All files: a plot for each filter, a plot for the encoder, and the page with its tables updated.
///
/// # Panics
/// When a plot cannot be drawn, or the page does not exist.
#[must_use]
pub fn files() -> Vec<File> {
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
