//! The corpus: data sheets that each show one way in which those of vendors differ, in the words of this project. The
//! first line of a file says which.

use std::fmt::Write as _;
use std::fs;
use std::path::PathBuf;

use eds::{Eds, Reals};

/// The mistakes that the reader reports, by file. A change of the reader shows here.
const WARNINGS: &str = include_str!("corpus/warnings.txt");

fn files() -> Vec<(String, Vec<u8>)> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/corpus");
    let paths = fs::read_dir(folder).expect("the corpus").map(|entry| entry.expect("an entry").path());
    let is_sheet = |path: &PathBuf| path.extension().is_some_and(|ending| ending != "txt");
    let mut files: Vec<_> = paths
        .filter(is_sheet)
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, fs::read(path).expect("a file"))
        })
        .collect();
    files.sort();
    files
}

#[test]
fn every_file_is_read_and_its_mistakes_are_named_with_their_lines() {
    let mut warnings = String::new();
    for (name, bytes) in files() {
        let sheet = Eds::from_bytes(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(sheet.objects.len() >= 12, "{name}: {} objects", sheet.objects.len());
        assert!(sheet.get(0x1018, 1).is_some() && sheet.get(0x1017, 0).is_some(), "{name}");
        for warning in &sheet.warnings {
            writeln!(warnings, "{name}: {warning}").expect("a string");
        }
    }
    assert_eq!(warnings, WARNINGS.replace("\r\n", "\n"), "{warnings}");
}

#[test]
fn a_sheet_that_is_read_can_be_written_and_read_again() {
    for (name, bytes) in files() {
        let sheet = Eds::from_bytes(&bytes).expect("a sheet");
        let again = Eds::parse(&sheet.to_dcf(&name, Reals::Decimal)).expect("a sheet");
        assert_eq!(again.objects.len(), sheet.objects.len(), "{name}");
        for (first, second) in sheet.entries().zip(again.entries()) {
            assert_eq!(
                (first.index, first.sub, first.data_type),
                (second.index, second.sub, second.data_type)
            );
            assert_eq!(first.default, second.default, "{name}: {:04X}h:{}", first.index, first.sub);
        }
    }
}

/// A file that ends within its last object is not taken for a whole one, whatever the vendor.
#[test]
fn a_file_that_is_cut_in_its_last_object_has_a_gap() {
    let mut cuts = 0;
    for (name, bytes) in files().into_iter().filter(|(name, _)| name.starts_with("plain-")) {
        let text = String::from_utf8(bytes).expect("a text");
        let section = text.rfind("\n[").expect("a section");
        let end = text.rfind("\nPDOMapping=").expect("a last key");
        for end in (section + 1..end).step_by(5) {
            let is_loss =
                Eds::parse(&text[..end]).map_or(true, |cut| cut.warnings.iter().any(eds::Error::is_loss));
            assert!(is_loss, "{name}: {}", &text[section..end]);
            cuts += 1;
        }
    }
    assert!(cuts > 100, "{cuts}");
}

/// A few bytes of each file are changed, and lines are removed: no text makes the reader panic.
#[test]
fn damaged_files_are_read_or_refused() {
    let mut state = 0x2545_F491_4F6C_DD1D_u64;
    let mut next = |below: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        usize::try_from(state % below as u64).expect("a small number")
    };
    let mut read = 0;
    let files = files();
    for (_, bytes) in &files {
        for _ in 0..20 {
            let mut damaged = bytes.clone();
            for _ in 0..=next(8) {
                let place = next(damaged.len());
                damaged[place] = *b"=[]\n;0xF\xFF$".get(next(10)).expect("a byte");
            }
            let start = next(damaged.len());
            damaged.drain(start..(start + next(200)).min(bytes.len()));
            read += usize::from(Eds::from_bytes(&damaged).is_ok());
        }
    }
    assert!(read > files.len() * 5, "{read}: most damages are small");
}
