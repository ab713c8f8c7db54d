//! Report as JUnit XML, for continuous integration.

use std::fmt::Write;

use super::frames;
use super::html::escaped;
use crate::check::{Result, Run, Verdict};

/// A test suite with a test case for each check. A deviation from a recommended rule is no failure; the output of the
/// test case names the reason.
#[must_use]
pub fn junit(run: &Run) -> String {
    let seconds = |time: u64| format!("{}.{:03}", time / 1_000_000, time / 1000 % 1000);
    let total: u64 = run.results.iter().map(|result| result.time.0).sum();
    let mut xml = format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<testsuite name=\"nodectl check, node {}\" tests=\"{}\" failures=\"{}\" errors=\"0\" \
         skipped=\"{}\" time=\"{}\">\n",
        run.node.get(),
        run.results.len(),
        run.count("failed"),
        run.count("skipped"),
        seconds(total)
    );
    for result in &run.results {
        // Writing to a string cannot fail.
        let _ = writeln!(
            xml,
            "  <testcase classname=\"{}\" name=\"{}\" time=\"{}\">{}</testcase>",
            result.check.group(),
            escaped(&format!("{} {}", result.check.id, result.check.title)),
            seconds(result.time.0),
            content(result)
        );
    }
    xml + "</testsuite>\n"
}

fn content(result: &Result) -> String {
    let text = |expected: &str, seen: &str| {
        let frames = frames::lines(&result.frames).join("\n");
        escaped(&format!("{}\nexpected: {expected}\nseen: {seen}\n{frames}\n", result.check.clause))
    };
    match &result.verdict {
        Verdict::Passed => String::new(),
        Verdict::Skipped(reason) => format!("<skipped message=\"{}\"/>", escaped(reason)),
        Verdict::Failed(deviation) => format!(
            "<failure message=\"{}\">{}</failure>",
            escaped(&format!("expected: {}; seen: {}", deviation.expected, deviation.seen)),
            text(&deviation.expected, &deviation.seen)
        ),
        Verdict::Recommended(deviation) => {
            format!("<system-out>recommended: {}</system-out>", text(&deviation.expected, &deviation.seen))
        }
    }
}
