//! The generated files in the tree are what the tables say now.

use eds::files;

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
