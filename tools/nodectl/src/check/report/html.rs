//! Report as a single HTML page.

use std::fmt::Write;

use super::frames;
use crate::check::{Result, Run, Verdict, about};
use crate::text::visible_lines;

const STYLE: &str = "body{font:15px sans-serif;max-width:70em;margin:2em auto;padding:0 1em;color:#222}table{border-collapse:collapse;width:\
100%}td,th{text-align:left;vertical-align:top;padding:.3em .6em;border-bottom:1px solid #ddd}.passed{color:#197a34}.failed{color:#b3201f;\
font-weight:bold}.recommended{color:#8a5a00}.skipped{color:#777}pre{background:#f4f4f4;padding:.6em;overflow:auto;max-height:24em}";

/// The whole run: the numbers, the checks that did not pass with their frames, and all checks.
#[must_use]
pub fn html(run: &Run) -> String {
    let node = run.node.get();
    let mut page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Node {node}: conformance</title><style>{STYLE}</style>\
         </head>\n<body>\n<h1>Node {node}: conformance</h1>\n<p>"
    );
    for word in ["passed", "failed", "recommended", "skipped"] {
        // Writing to a string cannot fail.
        let _ = write!(page, "<span class=\"{word}\">{} {word}</span> ", run.count(word));
    }
    page += "</p>\n";
    if !run.left_behind.is_empty() {
        let _ =
            writeln!(page, "<p class=\"failed\">Not put back: {}</p>", escaped(&run.left_behind.join(", ")));
    }
    for result in run.results.iter().filter(|result| result.verdict.deviation().is_some()) {
        page += &deviation(result);
    }
    page += "<h2>All checks</h2>\n<table><tr><th>Check</th><th>What the device does</th><th>Clause</th><th>Verdict</th></tr>\n";
    let mut group = "";
    for result in &run.results {
        if result.check.group() != group {
            group = result.check.group();
            let _ = writeln!(page, "<tr><th>{group}</th><th colspan=\"3\">{}</th></tr>", about(group));
        }
        page += &row(result);
    }
    page + "</table>\n</body></html>\n"
}

fn deviation(result: &Result) -> String {
    let Some(deviation) = result.verdict.deviation() else { return String::new() };
    format!(
        "<h3 id=\"{id}\" class=\"{word}\">{id} {title}</h3>\n<p>{clause}<br>Expected: {expected}<br>Seen: {seen}</p>\n<pre>{frames}</pre>\n",
        id = result.check.id,
        word = result.verdict.word(),
        title = escaped(result.check.title),
        clause = escaped(result.check.clause),
        expected = escaped(&deviation.expected),
        seen = escaped(&deviation.seen),
        frames = escaped(&frames::lines(&result.frames).join("\n"))
    )
}

fn row(result: &Result) -> String {
    let id = result.check.id;
    let word = result.verdict.word();
    let verdict = match &result.verdict {
        Verdict::Passed => word.to_owned(),
        Verdict::Skipped(reason) => format!("{word}: {}", escaped(reason)),
        Verdict::Failed(_) | Verdict::Recommended(_) => format!("<a href=\"#{id}\">{word}</a>"),
    };
    format!(
        "<tr><td>{id}</td><td>{}</td><td>{}</td><td class=\"{word}\">{verdict}</td></tr>\n",
        escaped(result.check.title),
        escaped(result.check.clause)
    )
}

/// Escapes a text for HTML and XML: texts of a device must not become part of the page, and XML has no control
/// characters.
pub(super) fn escaped(text: &str) -> String {
    let text = visible_lines(text);
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
