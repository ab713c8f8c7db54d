//! The page that states the figures. Its tables are between two markers; the command writes and checks them.

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::report::Report;

/// How much worse than stated a number may be, in per cent. A harmless change of the code stays below this limit.
const TOLERANCE: u64 = 5;
/// The limit in per cent when the compiler is not the stated one: another compiler makes other choices.
const OTHER_COMPILER: u64 = 25;

/// Replaces the tables.
pub(crate) fn write(path: &Path, report: &Report) -> Result<()> {
    let mut text = read(path)?;
    let place = place(&text, report.optimisation.name())?;
    text.replace_range(place, &format!("\n{report}"));
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

/// Compares our numbers with the page. The error names every number that is worse than stated.
pub(crate) fn check(path: &Path, report: &Report) -> Result<()> {
    let text = read(path)?;
    let stated = &text[place(&text, report.optimisation.name())?];
    let is_same = stated.contains(&format!("{} with", report.compiler));
    let tolerance = if is_same { TOLERANCE } else { OTHER_COMPILER };
    println!("{}; {tolerance} per cent more than stated are allowed", report.compiler);
    let worse = worse(stated, report, tolerance)?;
    if !worse.is_empty() {
        bail!("worse than {} states, with {}:\n{}", path.display(), report.compiler, worse.join("\n"));
    }
    Ok(())
}

fn worse(stated: &str, report: &Report, tolerance: u64) -> Result<Vec<String>> {
    let mut worse = vec![];
    for row in report.rows() {
        let limit = number(stated, row.name).with_context(|| format!("\"{}\" is not stated", row.name))?;
        let ours = row.cells[0].unwrap_or(u64::MAX);
        if ours > limit + limit * tolerance / 100 {
            worse.push(format!("{}: {ours}, stated {limit}", row.name));
        }
    }
    Ok(worse)
}

/// Our number in the line with this name.
fn number(stated: &str, name: &str) -> Option<u64> {
    let start = format!("| {name} | ");
    let line = stated.lines().find_map(|line| line.strip_prefix(&start))?;
    line.split(" |").next()?.parse().ok()
}

fn read(path: &Path) -> Result<String> {
    std::fs::read_to_string(path).with_context(|| path.display().to_string())
}

/// The range between the markers of the table `name`.
fn place(text: &str, name: &str) -> Result<Range<usize>> {
    let (begin, end) = (format!("<!-- bench: {name} -->\n"), format!("<!-- end of bench: {name} -->"));
    let start = text.find(&begin).with_context(|| format!("the page has no {begin:?}"))? + begin.len();
    let len = text[start..].find(&end).with_context(|| format!("the page has no {end:?}"))?;
    ensure!(!text[start..start + len].contains("<!--"), "the markers of the page are not in their order");
    Ok(start..start + len)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::{Optimisation, Row};

    fn report(ours: u64) -> Report {
        let row = Row { name: "an operation", cells: [Some(ours), None, None, Some(1)] };
        Report {
            optimisation: Optimisation::Size,
            compiler: "rustc 1.0.0".into(),
            operations: vec![row],
            sizes: vec![],
        }
    }

    const PAGE: &str = "# Title\n<!-- bench: size -->\nold\n<!-- end of bench: size -->\nmore\n";

    fn stated(ours: u64) -> String {
        format!("{}", report(ours))
    }

    #[test]
    fn tables_go_between_the_markers() {
        assert_eq!(&PAGE[place(PAGE, "size").unwrap()], "old\n");
        assert!(place(PAGE, "speed").is_err());
    }

    #[test]
    fn five_per_cent_are_tolerated_and_no_more() {
        assert_eq!(worse(&stated(1000), &report(1050), TOLERANCE).unwrap(), Vec::<String>::new());
        assert_eq!(
            worse(&stated(1000), &report(1051), TOLERANCE).unwrap(),
            ["an operation: 1051, stated 1000"]
        );
    }

    #[test]
    fn a_number_that_is_not_stated_is_an_error() {
        assert!(worse("nothing", &report(1), TOLERANCE).is_err());
    }
}
