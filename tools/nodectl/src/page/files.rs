//! The files of the page.

/// Path below the root, and content of each file.
static FILES: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// The path of the chart library, which comes from a package and not from the folder of the page.
const CHARTS: &str = "/lib/chart.js";

/// A file by its path; the path `/` is `index.html`.
pub(crate) fn find(path: &str) -> Option<(&'static str, &'static [u8])> {
    if path == CHARTS {
        return Some((media_type(CHARTS)?, rustlavel_chart::plugin::CHART_JS.as_bytes()));
    }
    let path = if path == "/" { "index.html" } else { path.strip_prefix('/')? };
    let (_, content) = FILES.iter().find(|(name, _)| *name == path)?;
    Some((media_type(path)?, content))
}

/// The media type of a file; `None` for a file that is not served.
fn media_type(path: &str) -> Option<&'static str> {
    Some(match path.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "js" | "mjs" => "text/javascript; charset=utf-8",
        "json" | "webmanifest" => "application/json",
        "svg" => "image/svg+xml",
        "png" => "image/png",
        "ico" => "image/x-icon",
        "woff2" => "font/woff2",
        "txt" => "text/plain; charset=utf-8",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use sha2::{Digest as _, Sha256};

    use super::*;

    /// `dist/chart.umd.js` of the npm package `chart.js` 4.5.1.
    const CHART_JS: &str = "ecc3cd1eeb8c34d2178e3f59fd63ec5a3d84358c11730af0b9958dc886d7652a";

    #[test]
    fn the_chart_library_is_the_one_that_its_authors_have_published() {
        let (media, content) = find(CHARTS).expect("it is there");
        assert!(media.starts_with("text/javascript"));
        let digest: String = Sha256::digest(content).iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(digest, CHART_JS);
    }

    #[test]
    fn a_path_is_one_of_the_list_or_nothing() {
        for path in ["", "/../Cargo.toml", "/../src/lib.rs", "//index.html", "/nothing.js", "/etc/passwd"] {
            assert!(find(path).is_none(), "{path}");
        }
        assert!(
            find("/").is_some_and(|(media, content)| media.starts_with("text/html") && !content.is_empty())
        );
    }
}
