//! `nodectl update`

use std::fmt;
use std::path::PathBuf;

use canopen::{Duration, NodeId};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::failure::update_code;
use super::output::hex;
use super::{Failure, Session};
use crate::text::{note, visible};
use crate::update::{Error, Image, Options, Outcome, Step, Watcher, update};

/// The greatest size of an image in bytes: more than the flash of any microcontroller on a CAN bus.
const LARGEST: u64 = 16 << 20;

/// Replaces the program of nodes (CiA 302-3), one after the other.
///
/// Board and version are checked before anything is erased. If a node or the bus is lost, the command waits for it
/// and continues the update. Node-IDs by --node: 1,2,5-8.
#[derive(Debug, Args)]
pub(super) struct Update {
    /// The image.
    image: PathBuf,

    /// Update also where the node runs this program already, or a newer one.
    #[arg(long)]
    force: bool,

    /// The file is of another format: download it unchanged, without a check of board and version.
    #[arg(long)]
    raw: bool,

    /// Leave the new program on trial: the node takes it back unless it is confirmed (2002h).
    #[arg(long)]
    no_confirm: bool,

    /// How long a node that is lost may stay away, in seconds.
    #[arg(long, value_name = "SECONDS", default_value_t = 60)]
    patience: u32,
}

#[derive(Serialize)]
struct Report {
    node: u8,
    result: &'static str,
    old_version: Option<String>,
    old_identification: Option<u32>,
    new_version: Option<String>,
    new_identification: Option<u32>,
    on_trial: bool,
    error: Option<String>,
}

impl Update {
    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        let nodes = session.options.node.list()?;
        let key = session.options.authorisation_key()?;
        let image = self.image()?;
        let options = Options {
            sdo: session.options.sdo(),
            patience: Duration::from_millis(u64::from(self.patience) * 1000),
            force: self.force,
            key,
            confirm: !self.no_confirm,
        };
        let results = update(&mut session.network, &nodes, &image, &options, &mut Bar::new());
        let explained = |error| session.explained_update(error);
        let results: Vec<_> =
            results.into_iter().map(|(node, result)| (node, result.map_err(explained))).collect();
        // With a single node, its error is the error of the command.
        for (node, result) in results.iter().filter(|(_, result)| result.is_ok() || nodes.len() > 1) {
            session.print(&Report::new(*node, result))?;
        }
        verdict(results)
    }

    fn image(&self) -> Result<Image, Failure> {
        let bytes =
            wire::input::read(&self.image, LARGEST).map_err(|error| Failure::file(&self.image, error))?;
        if self.raw {
            return Ok(Image::opaque(bytes));
        }
        Image::parse(bytes).map_err(|error| Failure::file(&self.image, error))
    }
}

/// The error of the only node, or the number of failed nodes.
fn verdict(results: Vec<(NodeId, Result<Outcome, Error>)>) -> Result<(), Failure> {
    let all = results.len();
    let mut errors: Vec<Error> = results.into_iter().filter_map(|(_, result)| result.err()).collect();
    match errors.first().map(update_code) {
        None => Ok(()),
        Some(_) if all == 1 => Err(errors.remove(0).into()),
        Some(exit_code) => Err(Failure::Nodes { failed: errors.len(), all, exit_code }),
    }
}

impl Report {
    fn new(node: NodeId, result: &Result<Outcome, Error>) -> Report {
        let outcome = result.as_ref().ok().cloned();
        let on_trial = outcome.as_ref().is_some_and(|outcome| outcome.is_on_trial);
        let what = match &outcome {
            None => "failed",
            Some(outcome) if outcome.is_changed => "updated",
            Some(_) => "unchanged",
        };
        let Outcome { old_version, old_identification, new_version, new_identification, .. } =
            outcome.unwrap_or_default();
        Report {
            node: node.get(),
            result: what,
            old_version,
            old_identification,
            new_version,
            new_identification,
            on_trial,
            error: result.as_ref().err().map(Error::to_string),
        }
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        if let Some(error) = &self.error {
            return write!(f, "{error}");
        }
        let program = |version: &Option<String>, identification| {
            format!("{} ({})", visible(version.as_deref().unwrap_or("no program")), hex(identification))
        };
        let old = program(&self.old_version, self.old_identification);
        let new = program(&self.new_version, self.new_identification);
        match self.result {
            "unchanged" => write!(f, "node {}: has {new} already; --force downloads it again", self.node)?,
            _ => write!(f, "node {}: {old} -> {new}", self.node)?,
        }
        if self.on_trial { f.write_str(", on trial") } else { Ok(()) }
    }
}

/// The progress on the standard error output, in one line of 80 columns.
struct Bar(ProgressBar);

/// The template for a step without a known duration; below it the template for a download.
const WAITING: &str = "{prefix} {msg:<20} {elapsed}";
const LOADING: &str = "{prefix} {msg:<20} [{bar:14}] {percent:>3} % {bytes_per_sec:>13} {eta:>4} left";

fn style(template: &str) -> ProgressStyle {
    let style = ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar());
    style.progress_chars("=> ")
}

impl Bar {
    fn new() -> Bar {
        Bar(ProgressBar::no_length().with_style(style(WAITING)))
    }
}

impl Watcher for Bar {
    fn step(&mut self, node: NodeId, step: Step) {
        self.0.set_prefix(format!("node {:>3}", node.get()));
        self.0.set_message(step.to_string());
        let is_loading = matches!(step, Step::Download | Step::DownloadSegments);
        self.0.set_style(style(if is_loading { LOADING } else { WAITING }));
        // The rate shown is the rate of the download alone, and the time is the time of the step.
        self.0.reset();
        // Without a terminal the steps are printed as lines.
        if self.0.is_hidden() {
            note(format_args!("node {}: {step}", node.get()));
        }
    }

    fn progress(&mut self, _: NodeId, done: usize, total: usize) {
        self.0.set_length(total as u64);
        self.0.set_position(done as u64);
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}
