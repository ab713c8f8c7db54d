//! The ways of an SDO write and of an RPDO through the CANopen library, as docs/architecture.md lists them: few files, none
//! entered twice.

use std::collections::BTreeSet;
use std::path::Path;

/// The files of the table whose first column has this heading.
fn files<'a>(page: &'a str, heading: &str) -> Vec<&'a str> {
    let table = page.split_once(heading).unwrap_or_else(|| panic!("no table `{heading}`")).1;
    let lines = table.lines().skip(1).take_while(|line| line.starts_with('|'));
    let cells = lines.filter_map(|line| line.rsplit('|').nth(1));
    cells.flat_map(|cell| cell.split('`').skip(1).step_by(2)).collect()
}

#[test]
fn a_write_enters_at_most_twelve_files_and_an_rpdo_eight() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let page = std::fs::read_to_string(root.join("docs/architecture.md")).unwrap();
    for (heading, most) in [("| step of a write |", 12), ("| step of an RPDO |", 8)] {
        let way = files(&page, heading);
        assert!(!way.is_empty() && way.len() <= most, "{heading} {way:?}");
        assert_eq!(way.iter().collect::<BTreeSet<_>>().len(), way.len(), "{heading} enters a file twice");
        for file in way {
            assert!(root.join("crates/canopen/src").join(file).is_file(), "{file}");
        }
    }
}
