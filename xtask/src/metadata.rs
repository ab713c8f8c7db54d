//! The packages of the workspace, as `cargo metadata` lists them.

use std::collections::{BTreeSet, HashMap};
use std::process::Command;

use serde::Deserialize;

/// The features of the released programs.
pub(crate) const RELEASED: &str = "nodectl/arrow";

/// The packages, and which of them depend on which.
#[derive(Deserialize)]
pub(crate) struct Metadata {
    pub(crate) packages: Vec<Package>,
    pub(crate) resolve: Resolve,
}

/// A package.
#[derive(Deserialize)]
pub(crate) struct Package {
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) license: Option<String>,
    #[allow(dead_code, reason = "each user of this file needs some of the fields")]
    pub(crate) version: String,
    /// Where the package comes from; `None` for a package of the workspace.
    #[allow(dead_code, reason = "each user of this file needs some of the fields")]
    pub(crate) source: Option<String>,
}

/// The dependencies of all packages.
#[derive(Deserialize)]
pub(crate) struct Resolve {
    pub(crate) nodes: Vec<Node>,
}

/// The dependencies of a package.
#[derive(Deserialize)]
pub(crate) struct Node {
    pub(crate) id: String,
    pub(crate) deps: Vec<Dependency>,
}

/// A dependency.
#[derive(Deserialize)]
pub(crate) struct Dependency {
    pub(crate) pkg: String,
    pub(crate) dep_kinds: Vec<Kind>,
}

/// The kind of a dependency.
#[derive(Deserialize)]
pub(crate) struct Kind {
    /// `None` for a dependency that is linked, else `build` or `dev`.
    pub(crate) kind: Option<String>,
}

impl Dependency {
    pub(crate) fn is_linked(&self) -> bool {
        self.dep_kinds.iter().any(|kind| kind.kind.is_none())
    }
}

impl Metadata {
    /// The packages for a machine.
    ///
    /// # Errors
    /// The output of cargo.
    pub(crate) fn of(platform: &str) -> Result<Metadata, String> {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut command = Command::new(cargo);
        command.args(["metadata", "--format-version", "1", "--locked", "--filter-platform", platform]);
        command.args(["--features", RELEASED]);
        command.current_dir(env!("CARGO_MANIFEST_DIR"));
        let output = command.output().map_err(|error| error.to_string())?;
        if !output.status.success() {
            return Err(String::from_utf8_lossy(&output.stderr).into_owned());
        }
        serde_json::from_slice(&output.stdout).map_err(|error| error.to_string())
    }

    /// The packages that are linked into a package of the workspace, including that package. `None` without such a
    /// package.
    pub(crate) fn linked(&self, root: &str) -> Option<Vec<&Package>> {
        let packages: HashMap<&str, &Package> =
            self.packages.iter().map(|own| (own.id.as_str(), own)).collect();
        let first = self.packages.iter().find(|package| package.name == root && package.source.is_none())?;
        let (mut found, mut left) = (BTreeSet::from([first.id.as_str()]), vec![first.id.as_str()]);
        while let Some(id) = left.pop() {
            for dependency in self.linked_into(id) {
                if found.insert(dependency) {
                    left.push(dependency);
                }
            }
        }
        Some(found.into_iter().filter_map(|id| packages.get(id).copied()).collect())
    }

    /// The packages that a package links directly.
    pub(crate) fn linked_into(&self, id: &str) -> impl Iterator<Item = &str> {
        let node = self.resolve.nodes.iter().find(|node| node.id == id);
        let linked = node.into_iter().flat_map(|node| &node.deps).filter(|dependency| dependency.is_linked());
        linked.map(|dependency| dependency.pkg.as_str())
    }
}
