//! Tests that the generated files in the tree agree with the tables.

use eds::{DEVICES, files};

#[test]
fn the_generated_files_are_up_to_date() {
    for file in files() {
        let text = std::fs::read_to_string(&file.path).unwrap_or_default();
        let path = file.path.display();
        if let Some((line, (old, new))) =
            (1..).zip(text.lines().zip(file.text.lines())).find(|(_, (old, new))| old != new)
        {
            println!("{path}:{line} has \"{old}\" for \"{new}\"");
        }
        assert!(text == file.text, "{path} is out of date: run `cargo xtask eds` and commit what it writes");
    }
}

#[test]
fn the_page_has_every_object_once_for_each_device_that_has_it() {
    let files = files();
    let page = files.iter().find(|file| file.path.ends_with("object-dictionary.md")).unwrap();
    let indices: Vec<u16> = DEVICES.iter().flat_map(|device| device.eds().objects.keys().copied()).collect();
    for index in &indices {
        let times = indices.iter().filter(|other| *other == index).count();
        assert_eq!(page.text.matches(&format!("| {index:04X}h | 0 ")).count(), times, "{index:04X}h");
    }
}

#[test]
fn every_section_of_the_data_sheet_has_a_table() {
    let files = files();
    let sheet = files.iter().find(|file| file.path.ends_with("data-sheet.md")).unwrap();
    let sections: Vec<&str> = sheet.text.split("\n## ").skip(1).collect();
    assert_eq!(sections.len(), 8);
    for section in sections {
        assert!(section.contains("|---|"), "{section}");
    }
}
