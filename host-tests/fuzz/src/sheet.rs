//! The reader of electronic data sheets: any file is refused with a reason, or every entry of the file can be found by
//! its path.

use eds::Eds;

/// Parses the bytes of a file.
pub fn run(data: &[u8]) {
    match Eds::from_bytes(data) {
        Err(error) => assert!(!error.to_string().is_empty(), "a refusal gives its reason"),
        Ok(sheet) => every_entry_can_be_found(&sheet),
    }
}

fn every_entry_can_be_found(sheet: &Eds) {
    for entry in sheet.entries() {
        let address = format!("{:04X}h:{}", entry.index, entry.sub);
        let found = sheet.get(entry.index, entry.sub);
        assert_eq!(found.map(|found| (found.index, found.sub)), Some((entry.index, entry.sub)), "{address}");
        // A foreign sheet may give two objects the same name; the path is then refused as ambiguous.
        let _ = sheet.find(&sheet.path(entry));
    }
}
