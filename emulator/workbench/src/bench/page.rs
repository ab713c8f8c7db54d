//! The page that states the figures. Its tables are between two markers; the command writes and checks them.

use std::ops::Range;
use std::path::Path;

use anyhow::{Context, Result, bail, ensure};

use crate::bench::report::Report;

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
    let other = if is_same { None } else { Some(OTHER_COMPILER) };
    let worse = worse(stated, report, other)?;
    if !worse.is_empty() {
        bail!("worse than {} states, with {}:\n{}", path.display(), report.compiler, worse.join("\n"));
    }
    Ok(())
}

/// The numbers that are worse than stated. `other` is the tolerance for another compiler.
fn worse(stated: &str, report: &Report, other: Option<u64>) -> Result<Vec<String>> {
    let mut worse = vec![];
    for (row, own) in report.rows() {
        let tolerance = other.unwrap_or(own);
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
    use crate::bench::report::{Optimisation, Row};

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
    fn five_per_cent_more_instructions_are_tolerated() {
        assert_eq!(worse(&stated(1000), &report(1050), None).unwrap(), Vec::<String>::new());
        assert_eq!(worse(&stated(1000), &report(1051), None).unwrap(), ["an operation: 1051, stated 1000"]);
    }

    #[test]
    fn one_per_cent_more_flash_is_tolerated() {
        let size = |ours| {
            let mut report = report(ours);
            report.sizes = std::mem::take(&mut report.operations);
            report
        };
        assert!(worse(&stated(1000), &size(1010), None).unwrap().is_empty());
        assert_eq!(worse(&stated(1000), &size(1011), None).unwrap().len(), 1);
        assert!(worse(&stated(1000), &size(1250), Some(OTHER_COMPILER)).unwrap().is_empty());
    }

    #[test]
    fn a_number_that_is_not_stated_is_an_error() {
        assert!(worse("nothing", &report(1), None).is_err());
    }
}
