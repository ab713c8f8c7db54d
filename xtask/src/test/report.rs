//! Runs named steps, several at a time, and tells how they went and how long they took.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::command::{target_dir, with_log};

/// How many of the slowest tests are named at the end.
const SLOWEST: usize = 12;

/// How often the number of tests that have run is told.
const PERIOD: Duration = Duration::from_secs(20);

/// Something to do, which succeeds or fails.
pub(super) struct Step {
    name: String,
    action: Box<dyn FnOnce() -> Result<()> + Send>,
}

impl Step {
    pub(super) fn new(name: impl Into<String>, action: impl FnOnce() -> Result<()> + Send + 'static) -> Step {
        Step { name: name.into(), action: Box::new(action) }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }
}

/// What was done.
struct Done {
    name: String,
    time: Duration,
    is_test: bool,
}

/// The steps that ran and those that failed.
pub(super) struct Report<'a> {
    only: Option<&'a str>,
    begin: Instant,
    done: Mutex<Vec<Done>>,
    failed: Mutex<Vec<String>>,
    /// The steps build on each other: after one that failed, no other begins.
    is_over: AtomicBool,
}

impl<'a> Report<'a> {
    /// With `only`, what has a name without this text is skipped.
    pub(super) fn new(only: Option<&'a str>) -> Result<Report<'a>> {
        fs::create_dir_all(logs())?;
        let (done, failed) = Default::default();
        Ok(Report { only, begin: Instant::now(), done, failed, is_over: AtomicBool::new(false) })
    }

    pub(super) fn only(&self) -> Option<&str> {
        self.only
    }

    /// Runs two lists of steps at the same time, each in its order.
    pub(super) fn lanes(&self, left: Vec<Step>, right: Vec<Step>) -> Result<()> {
        thread::scope(|scope| {
            scope.spawn(|| self.lane(left));
            self.lane(right);
        });
        self.ensure_none_failed()
    }

    fn lane(&self, steps: Vec<Step>) {
        for step in steps {
            let is_skipped = self.only.is_some_and(|only| !step.name.contains(only));
            if is_skipped || self.is_over.load(Ordering::Relaxed) {
                continue;
            }
            eprintln!("== {}", step.name);
            if !self.run(step, false) {
                self.is_over.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Runs tests in any order, as many at a time as there are cores. A test that fails keeps no other from running.
    pub(super) fn pool(&self, name: &str, tests: Vec<Step>) -> Result<()> {
        let all = tests.len();
        if all > 0 {
            eprintln!("== {all} {name}");
        }
        let workers = thread::available_parallelism().map_or(2, usize::from);
        let queue = Mutex::new(VecDeque::from(tests));
        let (finished, told) = (AtomicUsize::new(0), Mutex::new(Instant::now()));
        // The queue is free again before the test runs.
        let next = || lock(&queue).pop_front();
        thread::scope(|scope| {
            for _ in 0..workers {
                scope.spawn(|| {
                    while let Some(test) = next() {
                        self.run(test, true);
                        let number = finished.fetch_add(1, Ordering::Relaxed) + 1;
                        let mut told = lock(&told);
                        if told.elapsed() >= PERIOD {
                            *told = Instant::now();
                            eprintln!("{name}: {number} of {all}");
                        }
                    }
                });
            }
        });
        self.ensure_none_failed()
    }

    /// Runs one step. What it printed is told when it fails.
    fn run(&self, step: Step, is_test: bool) -> bool {
        let begin = Instant::now();
        let path = logs().join(step.name.replace(['/', ':', ' '], "_")).with_extension("log");
        let result =
            File::create(&path).context("cannot make a log").and_then(|log| with_log(log, step.action));
        let time = begin.elapsed();
        if let Err(error) = &result {
            let log = fs::read_to_string(&path).unwrap_or_default();
            eprintln!("{log}\nFAILED {}: {error:#}\n(the log is {})", step.name, path.display());
            lock(&self.failed).push(step.name.clone());
        } else if !is_test {
            eprintln!("   {} done in {:.1} s", step.name, time.as_secs_f64());
        }
        lock(&self.done).push(Done { name: step.name, time, is_test });
        result.is_ok()
    }

    fn ensure_none_failed(&self) -> Result<()> {
        let failed = lock(&self.failed);
        if failed.is_empty() {
            return Ok(());
        }
        let passed = lock(&self.done).len() - failed.len();
        println!("{passed} passed, {} failed", failed.len());
        bail!("failed: {}", failed.join(", "));
    }

    /// Prints the times of the steps and of the slowest tests, and the count; an error when nothing ran.
    pub(super) fn finish(self) -> Result<()> {
        let mut done = self.done.into_inner().unwrap_or_default();
        ensure!(!done.is_empty(), "nothing has a name that contains {:?}", self.only.unwrap_or_default());
        eprintln!("\nsteps:");
        for step in done.iter().filter(|step| !step.is_test) {
            eprintln!("{:>7.1} s  {}", step.time.as_secs_f64(), step.name);
        }
        remember(&done)?;
        done.retain(|done| done.is_test);
        done.sort_by_key(|test| std::cmp::Reverse(test.time));
        if !done.is_empty() {
            let sum: Duration = done.iter().map(|test| test.time).sum();
            eprintln!("\nthe slowest of {} tests, which took {:.1} s in all:", done.len(), sum.as_secs_f64());
        }
        for test in done.iter().take(SLOWEST) {
            eprintln!("{:>7.1} s  {}", test.time.as_secs_f64(), test.name);
        }
        eprintln!("\n{:>7.1} s  from begin to end", self.begin.elapsed().as_secs_f64());
        println!("{} passed, 0 failed", fs::read_to_string(times())?.lines().count());
        Ok(())
    }
}

/// Writes how long each step took, for the next run to begin with the slowest tests.
fn remember(done: &[Done]) -> Result<()> {
    let mut lines: Vec<String> =
        done.iter().map(|step| format!("{:.3} {}\n", step.time.as_secs_f64(), step.name)).collect();
    lines.sort();
    fs::write(times(), lines.concat()).context("cannot write the times")
}

/// How long a test took in the last run, in seconds.
pub(super) fn last_times() -> std::collections::HashMap<String, f64> {
    let text = fs::read_to_string(times()).unwrap_or_default();
    let line = |line: &str| {
        line.split_once(' ').and_then(|(time, name)| Some((name.to_owned(), time.parse().ok()?)))
    };
    text.lines().filter_map(line).collect()
}

fn times() -> PathBuf {
    logs().join("times.txt")
}

fn logs() -> PathBuf {
    target_dir().join("test-logs")
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
