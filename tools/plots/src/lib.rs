//! What the documentation shows of the measurement chain, computed with the chain itself: plots of input against output
//! for each filter, tables of settling times, delays and resolution, and what an encoder makes of disturbed readings.
//!
//! The output is the same on every run, so a test compares it with what lies in docs/.

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

/// A file that is generated, as a whole or in part.
#[derive(Clone, Debug)]
pub struct File {
    /// Where it lies.
    pub path: PathBuf,
    /// All of it.
    pub text: String,
}

/// Every file: a plot for each filter and one for the encoder, and the page with its tables brought up to date.
///
/// # Panics
/// When a plot cannot be drawn, or the page is not there.
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
