//! A list of named steps with their times.

use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

/// Runs steps one after the other and stops at the first that fails.
pub(crate) struct Steps<'a> {
    only: Option<&'a str>,
    done: Vec<(&'static str, Duration)>,
}

impl<'a> Steps<'a> {
    /// With `only`, steps whose name does not contain it are skipped.
    pub(crate) fn new(only: Option<&'a str>) -> Steps<'a> {
        Steps { only, done: Vec::new() }
    }

    /// Runs one step.
    pub(crate) fn run(&mut self, name: &'static str, step: impl FnOnce() -> Result<()>) -> Result<()> {
        if self.only.is_some_and(|only| !name.contains(only)) {
            return Ok(());
        }
        eprintln!("\n== {name}");
        let start = Instant::now();
        step().with_context(|| format!("step \"{name}\""))?;
        self.done.push((name, start.elapsed()));
        Ok(())
    }

    /// Prints what was done; an error when nothing was.
    pub(crate) fn finish(self) -> Result<()> {
        ensure!(
            !self.done.is_empty(),
            "no step has a name that contains {:?}",
            self.only.unwrap_or_default()
        );
        eprintln!();
        for (name, time) in &self.done {
            eprintln!("{:>7.1} s  {name}", time.as_secs_f64());
        }
        println!("{} passed, 0 failed", self.done.len());
        Ok(())
    }
}
