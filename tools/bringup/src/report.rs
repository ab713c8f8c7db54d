//! The results of the steps, as JSON for the next run and as HTML for people.

use std::fmt::Write as _;
use std::path::Path;
use std::process::ExitCode;

use anyhow::{Context, Result as Anyhow};
use serde::{Deserialize, Serialize};

/// The result of a check or of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Result {
    /// As expected.
    Green,
    /// Not as expected.
    Red,
    /// Not tried, or of no consequence.
    Skipped,
}

/// The exit status of a run: 1 for a step that is red, 2 for an error, which is printed.
pub fn exit_code(outcome: Anyhow<Result>) -> ExitCode {
    match outcome {
        Ok(Result::Red) => ExitCode::FAILURE,
        Ok(_) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// A check: what was seen, what was expected, and what to do when they differ.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Check {
    /// The checked property.
    pub what: String,
    /// The observed value.
    pub seen: String,
    /// The expected value.
    pub expected: String,
    /// The result.
    pub result: Result,
    /// The remedy of a failure.
    pub remedy: String,
}

/// A step and its checks.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StepReport {
    /// The number of the step.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// The property that it shows.
    pub about: String,
    /// The result of all checks.
    pub result: Result,
    /// The checks.
    pub checks: Vec<Check>,
}

impl StepReport {
    /// The step for a terminal: one line, and a line for each check that is not green.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text =
            format!("{:>2} {:<10} {:<8} {}\n", self.number, self.name, class(self.result), self.about);
        for check in self.checks.iter().filter(|check| check.result != Result::Green) {
            let Check { what, seen, expected, remedy, .. } = check;
            let _ = writeln!(text, "   {}: {what}: {seen}; expected: {expected}", class(check.result));
            if !remedy.is_empty() {
                let _ = writeln!(text, "   {remedy}");
            }
        }
        text
    }
}

/// All steps that have run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct Report {
    /// The steps, by number.
    pub steps: Vec<StepReport>,
}

impl Report {
    /// The report of an earlier run; an empty one without a file.
    ///
    /// # Errors
    /// The file is no report.
    pub fn read(path: &Path) -> Anyhow<Report> {
        match std::fs::read(path) {
            Ok(bytes) => serde_json::from_slice(&bytes)
                .with_context(|| format!("{} is no report of a bring-up", path.display())),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Report::default()),
            Err(error) => Err(error).with_context(|| format!("cannot read {}", path.display())),
        }
    }

    /// Writes the JSON file, and an HTML file beside it.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn write(&self, path: &Path) -> Anyhow<()> {
        let json = serde_json::to_string_pretty(self)?;
        std::fs::write(path, json).with_context(|| format!("cannot write {}", path.display()))?;
        let page = path.with_extension("html");
        std::fs::write(&page, self.html()).with_context(|| format!("cannot write {}", page.display()))
    }

    /// Whether a step has passed.
    #[must_use]
    pub fn is_green(&self, number: usize) -> bool {
        self.steps.iter().any(|step| step.number == number && step.result == Result::Green)
    }

    /// Replaces the report of a step.
    pub fn set(&mut self, step: StepReport) {
        self.steps.retain(|other| other.number != step.number);
        self.steps.push(step);
        self.steps.sort_by_key(|step| step.number);
    }

    /// The report as a page.
    #[must_use]
    pub fn html(&self) -> String {
        let mut page = String::from(HEAD);
        for step in &self.steps {
            let class = class(step.result);
            let _ = write!(
                page,
                "<h2 class={class}>{} {}</h2><p>{}</p><table><tr><th>check<th>seen<th>expected<th>if it is red</tr>",
                step.number,
                escaped(&step.name),
                escaped(&step.about)
            );
            for check in &step.checks {
                let cells =
                    [&check.what, &check.seen, &check.expected, &check.remedy].map(|text| escaped(text));
                let _ =
                    write!(page, "<tr class={}><td>{}</tr>", self::class(check.result), cells.join("<td>"));
            }
            page.push_str("</table>");
        }
        page
    }
}

const HEAD: &str = "<!doctype html><meta charset=utf-8><title>Bring-up</title><style>body{font:15px system-ui;\
max-width:70em;margin:2em auto;color-scheme:light dark}table{border-collapse:collapse;width:100%}td,th{text-align:left;\
padding:.3em .6em;border-bottom:1px solid #8888}.red{color:#d33}.green{color:#2a2}.skipped{color:#888}</style><h1>Bring-up</h1>";

fn class(result: Result) -> &'static str {
    match result {
        Result::Green => "green",
        Result::Red => "red",
        Result::Skipped => "skipped",
    }
}

/// Text for a page: a log line of a node may contain anything.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(number: usize, result: Result) -> StepReport {
        let check = Check {
            what: "clock".into(),
            seen: "<b>none</b>".into(),
            expected: "8 MHz".into(),
            result,
            remedy: "close SB16".into(),
        };
        StepReport { number, name: "clock".into(), about: "the clock".into(), result, checks: vec![check] }
    }

    #[test]
    fn a_step_that_is_repeated_replaces_the_one_before() {
        let mut report = Report::default();
        report.set(step(4, Result::Red));
        report.set(step(1, Result::Green));
        assert!(!report.is_green(4) && report.is_green(1));
        report.set(step(4, Result::Green));
        assert_eq!(report.steps.iter().map(|step| step.number).collect::<Vec<_>>(), [1, 4]);
        assert!(report.is_green(4));
    }

    #[test]
    fn text_of_a_board_is_no_markup() {
        let mut report = Report::default();
        report.set(step(4, Result::Red));
        let page = report.html();
        assert!(
            page.contains("&lt;b&gt;none&lt;/b&gt;") && page.contains("close SB16") && !page.contains("<b>")
        );
    }
}
