//! The tables of docs/measuring.md. Each table is between two comments, which Markdown does not show.

use crate::resolution::resolution;
use crate::response::{Filter, delay, settling};

const CONSTANTS: [u8; 5] = [1, 2, 10, 100, 255];

/// The page with updated tables.
pub(crate) fn updated(page: &str) -> String {
    let page = replaced(page, "filters", &filters());
    replaced(&page, "resolution", &resolutions())
}

/// Replaces the text between the comments of this name.
fn replaced(page: &str, name: &str, table: &str) -> String {
    let (begin, end) = (format!("<!-- begin {name} -->\n"), format!("<!-- end {name} -->"));
    let (before, rest) = page.split_once(&begin).unwrap_or_else(|| panic!("the page has no {begin}"));
    let (_, after) = rest.split_once(&end).unwrap_or_else(|| panic!("the page has no {end}"));
    format!("{before}{begin}{table}{end}{after}")
}

fn filters() -> String {
    let mut table = String::from(
        "| filter | constant | 63.2 % | 90 % | 99 % | 99.9 % | behind a ramp |\n|---|---|---|---|---|---|---|\n",
    );
    table += &row(Filter { kind: 0, constant: 1 });
    for kind in [1, 2] {
        table.extend(CONSTANTS.map(|constant| row(Filter { kind, constant })));
    }
    table
}

fn row(filter: Filter) -> String {
    let constant = if filter.kind == 0 { "any".into() } else { filter.constant.to_string() };
    let times = [0.368, 0.1, 0.01, 0.001].map(|missing| settling(filter, missing).to_string());
    let (least, most) = delay(filter);
    let (least, most) = (format!("{:.1}", least.abs()), format!("{:.1}", most.abs()));
    let behind = if least == most { least } else { format!("{least} to {most}") };
    format!("| {} | {constant} | {} | {behind} |\n", filter.name(), times.join(" | "))
}

fn resolutions() -> String {
    let mut table = String::from("| noise of a conversion | error | bits | of 10 bar |\n|---|---|---|---|\n");
    for noise in [0.0, 0.25, 0.5, 1.0, 2.0] {
        let left = resolution(noise);
        table += &format!("| {noise} | {:.2} | {:.1} | {:.0} Pa |\n", left.steps, left.bits(), left.pascal);
    }
    table
}
