//! `nodectl check`

use std::fmt;
use std::io::{self, BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use canopen::{Duration, NodeId};
use clap::Args;
use eds::Eds;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use super::replacement::Replacement;
use super::{Failure, Session, failure};
use crate::check::{self, Check as Rule, Effect, Profile, Setup, Stop, Subject, Verdict, about, report};
use crate::object::at;
use crate::text::note;

/// How long a device may take to boot.
const BOOT: Duration = Duration::from_millis(10_000);

/// Judges a device by CiA 301, CiA 305 and its data sheet.
///
/// Each check is one rule of a clause. What a check changes is put back; nothing is restarted or saved before you have agreed.
/// The device should be alone on the bus: otherwise checks that reach others are skipped.
#[derive(Debug, Args)]
pub(super) struct Check {
    /// Only these checks: names, groups or beginnings of names (SDO-07,NMT).
    #[arg(long, value_name = "ID,...", value_delimiter = ',')]
    only: Vec<String>,

    /// The mandatory objects of a device profile too.
    #[arg(long)]
    profile: Option<Profile>,

    /// List the checks, and do nothing else.
    #[arg(long)]
    list: bool,

    /// Explain a check, and do nothing else.
    #[arg(long, value_name = "ID")]
    explain: Option<String>,

    /// Do not ask before the device is restarted, saves its parameters and gets its defaults.
    #[arg(long)]
    yes: bool,

    /// Write a report for continuous integration: JUnit XML.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,

    /// Write a report as one HTML page, with the frames of the failed checks.
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
}

impl Check {
    /// Whether the command needs a device: without one, checks can be listed and explained.
    pub(super) const fn needs_a_bus(&self) -> bool {
        !self.list && self.explain.is_none()
    }

    pub(super) fn run(&self, session: &mut Session) -> Result<(), Failure> {
        if let Some(id) = &self.explain {
            return self.explain(session, id);
        }
        let checks = self.checks()?;
        if self.list {
            return checks.iter().try_for_each(|check| session.print(&Listed::new(check)));
        }
        let allowed = self.allowed(session, &checks)?;
        let run = Check::try_all(session, check::Options { checks, allowed })?;
        self.write_reports(&run)?;
        Check::show(session, &run)?;
        if run.is_interrupted {
            return Err(Failure::Interrupted { left_behind: run.left_behind });
        }
        match run.count("failed") {
            0 if run.left_behind.is_empty() => Ok(()),
            failed => Err(Failure::NotConforming { failed, left_behind: run.left_behind }),
        }
    }

    /// The selected checks, in their order.
    fn checks(&self) -> Result<Vec<Rule>, Failure> {
        let all = check::all(self.profile);
        for text in &self.only {
            if !all.iter().any(|check| check.is_meant(text)) {
                return Err(Failure::Usage(format!("no check is called \"{text}\": see --list")));
            }
        }
        let is_wanted =
            |check: &Rule| self.only.is_empty() || self.only.iter().any(|text| check.is_meant(text));
        Ok(all.into_iter().filter(is_wanted).collect())
    }

    fn explain(&self, session: &mut Session, id: &str) -> Result<(), Failure> {
        let profiles = Profile::ALL.into_iter().flat_map(|profile| check::all(Some(profile)));
        let found = profiles.into_iter().find(|check| check.id.eq_ignore_ascii_case(id));
        match found {
            Some(check) => session.print(&Explained(Listed::new(&check))),
            None => Err(Failure::Usage(format!("no check is called \"{id}\": see --list"))),
        }
    }

    /// The strongest effect that the checks may have. The user is asked once if a check has an effect.
    fn allowed(&self, session: &Session, checks: &[Rule]) -> Result<Effect, Failure> {
        let strongest = checks.iter().map(|check| check.effect).max().unwrap_or(Effect::None);
        if strongest == Effect::None || self.yes {
            return Ok(strongest);
        }
        if session.options.json || !io::stdin().is_terminal() {
            return Ok(Effect::None);
        }
        let count = |effect| checks.iter().filter(|check| check.effect == effect).count();
        let (resets, stores) = (count(Effect::Resets), count(Effect::Stores));
        write!(
            io::stderr(),
            "{resets} checks restart the device; {stores} also save its parameters or bring its defaults back, and save again what it had. \
             Do them? [y/N] "
        )?;
        io::stderr().flush()?;
        let mut answer = String::new();
        io::stdin().lock().read_line(&mut answer)?;
        let is_yes = matches!(answer.trim(), "y" | "Y" | "yes");
        Ok(if is_yes { strongest } else { Effect::None })
    }

    fn try_all(session: &mut Session, options: check::Options) -> Result<check::Run, Failure> {
        let node = session.options.node.one()?;
        let sheet = Check::sheet(session, node)?;
        // The default SDO server is judged, not the one that other commands prefer.
        session.network.set_channel(node, None);
        let setup = Setup { node, sheet, timeout: session.options.timeout(), boot: BOOT };
        let bar = bar(options.checks.len());
        let interruption = interruption(at_once(node, options.allowed));
        let is_interrupted = move || interruption.load(Ordering::Relaxed);
        let mut subject = Subject::new(&mut session.network, setup).with_interruption(is_interrupted);
        let run = check::run(&mut subject, &options, |result| {
            bar.set_message(result.check.id);
            bar.inc(1);
        });
        bar.finish_and_clear();
        run.map_err(|stop| match stop {
            Stop::Bus(error) => error.into(),
            Stop::Failed(deviation) => Failure::Silence(format!(
                "node {}: expected {}; seen: {}",
                node.get(),
                deviation.expected,
                deviation.seen
            )),
            Stop::Skipped(reason) => Failure::Usage(reason),
            Stop::Interrupted => Failure::Interrupted { left_behind: Vec::new() },
        })
    }

    /// The data sheet of the options, else the built-in data sheet for the identity of the device. A bootloader has the
    /// identity of its device but another device type: no built-in data sheet is for a bootloader.
    fn sheet(session: &mut Session, node: NodeId) -> Result<Option<Eds>, Failure> {
        let catalogue = session.catalogue(node)?;
        let sheet = catalogue.is_of_a_device().then(|| catalogue.sheet().clone());
        if session.options.eds.is_some() {
            return Ok(sheet);
        }
        let Some(sheet) = sheet else { return Ok(None) };
        // The low word is the profile. The high word may depend on the configuration of the device.
        let declared = match sheet.get(0x1000, 0).and_then(|entry| entry.default.as_ref()) {
            Some(eds::Formula::Constant(eds::Value::Integer(number))) => number & 0xFFFF,
            _ => return Ok(Some(sheet)),
        };
        let seen = session.word(node, at(0x1000, 0))?.map(|word| i128::from(word & 0xFFFF));
        Ok(Some(sheet).filter(|_| seen == Some(declared)))
    }

    fn write_reports(&self, run: &check::Run) -> Result<(), Failure> {
        if let Some(path) = &self.junit {
            Replacement::write(path, report::junit(run).as_bytes())?;
        }
        if let Some(path) = &self.html {
            Replacement::write(path, report::html(run).as_bytes())?;
        }
        Ok(())
    }

    fn show(session: &mut Session, run: &check::Run) -> Result<(), Failure> {
        if session.options.json {
            return Ok(session.output.json(&report::json(run))?);
        }
        session.print(&Table(run))
    }
}

/// Whether a signal has come (Ctrl-C, SIGTERM). The second one ends the program at once, with these words.
fn interruption(at_once: String) -> Arc<AtomicBool> {
    let is_interrupted = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&is_interrupted);
    // Only one handler is possible; a program that has one already is not interrupted.
    let _ = ctrlc::set_handler(move || {
        if told.swap(true, Ordering::Relaxed) {
            note(&at_once);
            std::process::exit(failure::INTERRUPTED.into());
        }
        note("interrupted: the device gets its values back; a second Ctrl-C ends at once");
    });
    is_interrupted
}

/// The values that may stay changed when a run ends before it has restored them.
fn at_once(node: NodeId, allowed: Effect) -> String {
    let saved = match allowed {
        Effect::Stores => "; its saved parameters may be the defaults or those of a check",
        _ => "",
    };
    format!(
        "ended at once: node {} may have values and the NMT state of a check until its next reset{saved}",
        node.get()
    )
}

/// A progress bar, which is only visible on a terminal.
fn bar(length: usize) -> ProgressBar {
    let bar = ProgressBar::new(length as u64);
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} {msg}") {
        bar.set_style(style);
    }
    bar
}

/// A check in a list.
#[derive(Serialize)]
struct Listed {
    id: &'static str,
    title: &'static str,
    clause: &'static str,
    effect: Effect,
    is_recommended: bool,
}

impl Listed {
    fn new(check: &Rule) -> Listed {
        let is_recommended = check.level == check::Level::Recommended;
        Listed {
            id: check.id,
            title: check.title,
            clause: check.clause,
            effect: check.effect,
            is_recommended,
        }
    }
}

impl fmt::Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mark = match self.effect {
            Effect::None => ' ',
            Effect::Resets => 'r',
            Effect::Stores => 's',
        };
        write!(f, "{:<8} {mark} {} ({})", self.id, self.title, self.clause)
    }
}

/// A check with its explanation.
#[derive(Serialize)]
struct Explained(Listed);

impl fmt::Display for Explained {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Listed { id, title, clause, effect, is_recommended } = &self.0;
        let group = id.split('-').next().unwrap_or_default();
        writeln!(f, "{id}: {title}")?;
        writeln!(f, "About: {}", about(group))?;
        writeln!(
            f,
            "Rule: {clause}, which {}",
            if *is_recommended { "recommends this" } else { "demands this" }
        )?;
        write!(
            f,
            "Effect: {}",
            match effect {
                Effect::None => "none that stays; what is written is written back",
                Effect::Resets =>
                    "the device or its communication restarts; values that are not saved are written back after the run",
                Effect::Stores =>
                    "the device restarts, and its memory is written; what was saved before is saved again",
            }
        )
    }
}

/// All results as a table for people.
struct Table<'r>(&'r check::Run);

impl Serialize for Table<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        report::json(self.0).serialize(serializer)
    }
}

impl fmt::Display for Table<'_> {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut group = "";
        for result in &self.0.results {
            if result.check.group() != group {
                group = result.check.group();
                writeln!(f, "{group}: {}", about(group))?;
            }
            let word = result.verdict.word();
            writeln!(f, "  {:<8} {word:<11}  {}", result.check.id, result.check.title)?;
            match &result.verdict {
                Verdict::Passed => (),
                Verdict::Skipped(reason) => writeln!(f, "{:24}{reason}", "")?,
                Verdict::Failed(deviation) | Verdict::Recommended(deviation) => {
                    writeln!(f, "{:24}{}", "", result.check.clause)?;
                    writeln!(f, "{:24}expected: {}", "", deviation.expected)?;
                    writeln!(f, "{:24}seen:     {}", "", deviation.seen)?;
                }
            }
        }
        for left in &self.0.left_behind {
            writeln!(f, "not put back: {left}")?;
        }
        let count = |word| self.0.count(word);
        write!(
            f,
            "{} passed, {} failed, {} recommended, {} skipped",
            count("passed"),
            count("failed"),
            count("recommended"),
            count("skipped")
        )
    }
}
