//! `cargo xtask docs`: the documents as one site with search, beside the documentation of the library.
//!
//! `docs/SUMMARY.md` lists the documents. A copy of the listed files keeps their places in the repository, so that the
//! links from one document to another lead to the right page.

use std::fs;
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result};

use crate::command::{cargo, root, run, target_dir};
use crate::tools;

/// The folders with the files that documents show or offer.
const FOLDERS: [&str; 5] = ["docs", "docs/drawings", "docs/pictures", "docs/plots", "eds"];

/// Builds the site, and prints the path of its first page.
pub(crate) fn build() -> Result<()> {
    let book = target_dir().join("book");
    if book.exists() {
        fs::remove_dir_all(&book)?;
    }
    let summary = fs::read_to_string(root().join("docs/SUMMARY.md"))?;
    let documents = documents(&summary);
    for file in documents.iter().chain(&shown_files()?) {
        copy(file, &book.join("src"))?;
    }
    fs::write(book.join("src/SUMMARY.md"), from_the_root(&summary))?;
    fs::copy(root().join("docs/book.toml"), book.join("book.toml"))?;

    run(cargo().args(["doc", "--quiet", "--no-deps", "-p", "canopen-device"]))?;
    tools::with("mdbook")?;
    let site = target_dir().join("doc/book");
    run(Command::new(target_dir().join("tools/bin/mdbook"))
        .arg("build")
        .arg("--dest-dir")
        .arg(&site)
        .arg(&book))?;
    // mdbook calls the page of a README `index.html`, and links to it `README.html`.
    for readme in documents.iter().filter(|file| file.ends_with("README.md")) {
        let page = site.join(readme).with_extension("html");
        fs::copy(page.with_file_name("index.html"), page)?;
    }
    println!("{}", site.join("index.html").display());
    println!("{}", target_dir().join("doc/canopen/index.html").display());
    Ok(())
}

/// The files that a summary in `docs` links to, as paths from the root.
fn documents(summary: &str) -> Vec<PathBuf> {
    let links = summary.split("](").skip(1).filter_map(|rest| rest.split_once(')'));
    links.map(|(link, _)| resolved(Path::new(link))).collect()
}

/// The summary with its links from the root.
fn from_the_root(summary: &str) -> String {
    let mut text = String::new();
    for (number, part) in summary.split("](").enumerate() {
        match part.split_once(')') {
            Some((link, rest)) if number > 0 => {
                text += &format!("]({}){rest}", resolved(Path::new(link)).display());
            }
            _ => text += part,
        }
    }
    text
}

/// A link from `docs`, as a path from the root.
fn resolved(link: &Path) -> PathBuf {
    let mut path = PathBuf::from("docs");
    for part in link.components() {
        match part {
            Component::ParentDir => drop(path.pop()),
            part => path.push(part),
        }
    }
    path
}

/// The files of the folders that are no documents.
fn shown_files() -> Result<Vec<PathBuf>> {
    let mut files = Vec::new();
    for folder in FOLDERS {
        for entry in fs::read_dir(root().join(folder))? {
            let path = entry?.path();
            if path
                .extension()
                .is_some_and(|ending| ["svg", "png", "eds"].iter().any(|known| ending == *known))
            {
                files.push(path.strip_prefix(root())?.to_owned());
            }
        }
    }
    Ok(files)
}

/// Copies a file to the same place below `folder`.
fn copy(file: &Path, folder: &Path) -> Result<()> {
    let place = folder.join(file);
    fs::create_dir_all(place.parent().context("a file has a folder")?)?;
    fs::copy(root().join(file), &place).with_context(|| format!("cannot copy {}", file.display()))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_of_the_summary_are_paths_from_the_root() {
        let summary = "# A\n\n[a](../README.md)\n- [b](b.md)\n    - [c](../tools/c.md)\n";
        let paths = ["README.md", "docs/b.md", "tools/c.md"];
        assert_eq!(documents(summary), paths.map(PathBuf::from));
        assert_eq!(
            from_the_root(summary),
            "# A\n\n[a](README.md)\n- [b](docs/b.md)\n    - [c](tools/c.md)\n"
        );
    }

    #[test]
    fn every_document_of_the_summary_exists() {
        let summary = fs::read_to_string(root().join("docs/SUMMARY.md")).unwrap();
        assert!(documents(&summary).len() > 25);
        assert!(documents(&summary).iter().all(|document| root().join(document).is_file()));
    }
}
