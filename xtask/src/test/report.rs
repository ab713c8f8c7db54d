//! Runs named steps, several at a time, and reports their results and times.

use std::collections::VecDeque;
use std::fs::{self, File};
use std::path::PathBuf;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, bail, ensure};

use crate::command::{target_dir, with_log};

/// The number of slowest tests that the report names.
const SLOWEST: usize = 12;

/// Tests that mostly wait run beside the others: this many for each core.
const WAITING: usize = 2;

/// How far work steps back where the cores are short, as the nice value of Linux: tests with the clock of a real board
/// come first, then the other tests, then lints and documentation.
const TESTS: i32 = 5;
const LANES: i32 = 15;

/// The period of printing the number of finished tests.
const PERIOD: Duration = Duration::from_secs(20);

/// A test that runs for longer is named beside this number.
const LONG: Duration = Duration::from_mins(3);

/// An action with a name, which succeeds or fails.
pub(super) struct Step {
    name: String,
    /// Whether the step mostly waits, as a test at the speed of a real board does.
    waits: bool,
    action: Box<dyn FnOnce() -> Result<()> + Send>,
}

impl Step {
    pub(super) fn new(name: impl Into<String>, action: impl FnOnce() -> Result<()> + Send + 'static) -> Step {
        Step { name: name.into(), waits: false, action: Box::new(action) }
    }

    /// The same step, marked as one that mostly waits.
    pub(super) fn that_waits(self) -> Step {
        Step { waits: true, ..self }
    }

    pub(super) fn name(&self) -> &str {
        &self.name
    }
}

/// The tests that wait for a worker. A failed test does not stop the others.
struct Pool {
    all: usize,
    busy: Mutex<VecDeque<Step>>,
    waiting: Mutex<VecDeque<Step>>,
    running: Mutex<Vec<(String, Instant)>>,
    finished: AtomicUsize,
}

impl Pool {
    fn new(tests: Vec<Step>) -> Pool {
        let all = tests.len();
        if all > 0 {
            eprintln!("== {all} tests");
        }
        let (waiting, busy): (VecDeque<Step>, VecDeque<Step>) =
            tests.into_iter().partition(|test| test.waits);
        let (busy, waiting) = (Mutex::new(busy), Mutex::new(waiting));
        Pool { all, busy, waiting, running: Mutex::default(), finished: AtomicUsize::new(0) }
    }

    /// Runs tests from a queue until it is empty.
    fn work(&self, queue: &Mutex<VecDeque<Step>>, run: impl Fn(Step)) {
        // The lock is released before the test runs.
        let next = || lock(queue).pop_front();
        while let Some(test) = next() {
            let name = test.name.clone();
            lock(&self.running).push((name.clone(), Instant::now()));
            run(test);
            lock(&self.running).retain(|(running, _)| *running != name);
            self.finished.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Prints the number of finished tests each [`PERIOD`], until the other ends of the channel are gone.
    fn tell(&self, end: &Receiver<()>) {
        let mut told = 0;
        while end.recv_timeout(PERIOD) == Err(RecvTimeoutError::Timeout) {
            let (finished, long) = (self.finished.load(Ordering::Relaxed), self.long());
            if finished != told || !long.is_empty() {
                eprintln!("tests: {finished} of {}{long}", self.all);
            }
            told = finished;
        }
    }

    /// The tests that run for longer than [`LONG`], with their times.
    fn long(&self) -> String {
        let running = lock(&self.running);
        let long =
            running.iter().map(|(name, begin)| (name, begin.elapsed())).filter(|(_, time)| *time > LONG);
        long.map(|(name, time)| format!("; {name} runs for {} s", time.as_secs())).collect()
    }
}

/// A finished step.
struct Done {
    name: String,
    time: Duration,
    is_test: bool,
}

/// The steps that have run, and those that have failed.
pub(super) struct Report<'a> {
    only: Option<&'a str>,
    begin: Instant,
    done: Mutex<Vec<Done>>,
    failed: Mutex<Vec<String>>,
}

impl<'a> Report<'a> {
    /// With `only`, steps whose name lacks this text are skipped.
    pub(super) fn new(only: Option<&'a str>) -> Result<Report<'a>> {
        fs::create_dir_all(logs())?;
        let (done, failed) = Default::default();
        Ok(Report { only, begin: Instant::now(), done, failed })
    }

    pub(super) fn only(&self) -> Option<&str> {
        self.only
    }

    /// Runs the builds of two lanes, each in its order. The tests depend on them: none begins after a failed one.
    pub(super) fn build(&self, lanes: [Vec<Step>; 2]) -> Result<()> {
        thread::scope(|scope| {
            for lane in lanes {
                scope.spawn(|| self.lane(lane, || lock(&self.failed).is_empty()));
            }
        });
        self.ensure_none_failed()
    }

    /// Runs the checks of two lanes, each in its order, and the tests in any order beside them: one test per core, and
    /// [`WAITING`] tests per core that mostly wait. A failed one stops no other one.
    pub(super) fn run(&self, lanes: [Vec<Step>; 2], tests: Vec<Step>) -> Result<()> {
        let workers = thread::available_parallelism().map_or(2, usize::from);
        let pool = &Pool::new(tests);
        thread::scope(|scope| {
            let (work, end) = mpsc::channel();
            scope.spawn(move || pool.tell(&end));
            for lane in lanes {
                scope.spawn(|| {
                    step_back(LANES);
                    self.lane(lane, || true);
                });
            }
            let queues = [(&pool.busy, workers, TESTS), (&pool.waiting, WAITING * workers, 0)];
            for (queue, number, nice) in queues {
                for _ in 0..number {
                    let work = work.clone();
                    scope.spawn(move || {
                        step_back(nice);
                        pool.work(queue, |test| self.step(test, true));
                        drop(work);
                    });
                }
            }
        });
        self.ensure_none_failed()
    }

    /// Runs the steps of a lane, each if it may begin.
    fn lane(&self, steps: Vec<Step>, may_begin: impl Fn() -> bool) {
        for step in steps {
            let is_skipped = self.only.is_some_and(|only| !step.name.contains(only));
            if is_skipped || !may_begin() {
                continue;
            }
            eprintln!("== {}", step.name);
            self.step(step, false);
        }
    }

    /// Runs one step. Its output is printed when it fails.
    fn step(&self, step: Step, is_test: bool) {
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

    /// Prints the times of the steps and of the slowest tests, and the count. Fails when nothing has run.
    pub(super) fn finish(self) -> Result<()> {
        let mut done = self.done.into_inner().unwrap_or_default();
        ensure!(!done.is_empty(), "nothing has a name that contains {:?}", self.only.unwrap_or_default());
        eprintln!("\nsteps:");
        for step in done.iter().filter(|step| !step.is_test) {
            eprintln!("{:>7.1} s  {}", step.time.as_secs_f64(), step.name);
        }
        remember(&done)?;
        let passed = done.len();
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
        println!("{passed} passed, 0 failed");
        Ok(())
    }
}

/// Raises the nice value of this thread and of the programs that it starts. Elsewhere than on Linux all have the same.
fn step_back(nice: i32) {
    #[cfg(target_os = "linux")]
    let _ = rustix::process::nice(nice);
    #[cfg(not(target_os = "linux"))]
    let _ = nice;
}

/// Saves the time of each step, so that the next run can begin with the slowest tests. Steps that have not run keep
/// their time.
fn remember(done: &[Done]) -> Result<()> {
    let mut times = last_times();
    times.extend(done.iter().map(|step| (step.name.clone(), step.time.as_secs_f64())));
    let mut lines: Vec<String> = times.iter().map(|(name, time)| format!("{time:.3} {name}\n")).collect();
    lines.sort();
    fs::write(times_file(), lines.concat()).context("cannot write the times")
}

/// The time of each test in its last run, in seconds.
pub(super) fn last_times() -> std::collections::HashMap<String, f64> {
    let text = fs::read_to_string(times_file()).unwrap_or_default();
    let line = |line: &str| {
        line.split_once(' ').and_then(|(time, name)| Some((name.to_owned(), time.parse().ok()?)))
    };
    text.lines().filter_map(line).collect()
}

fn times_file() -> PathBuf {
    logs().join("times.txt")
}

fn logs() -> PathBuf {
    target_dir().join("test-logs")
}

fn lock<T>(mutex: &Mutex<T>) -> std::sync::MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}
