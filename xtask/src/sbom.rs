//! `cargo xtask sbom`: the software bill of materials of each product, in the format CycloneDX 1.5. The file depends on
//! `Cargo.lock` and the compiler alone: it has no date, and no random number.

use std::collections::HashMap;
use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, anyhow, ensure};
use clap::Args;
use serde_json::{Value as Json, json};

use crate::command::root;
use crate::metadata::{Metadata, Package};
use crate::target::{TRIPLE, Toolchain};

/// The products, and whether each runs on the Cortex-M4.
const PRODUCTS: [(&str, bool); 3] = [("firmware", true), ("bootloader", true), ("nodectl", false)];

#[derive(Args)]
pub(crate) struct Flags {
    /// The directory of the files
    #[arg(long, value_name = "DIR", default_value = "target/sbom")]
    out: PathBuf,
}

pub(crate) fn write(flags: &Flags) -> Result<()> {
    fs::create_dir_all(&flags.out).with_context(|| format!("cannot make {}", flags.out.display()))?;
    let lock = fs::read_to_string(root().join("Cargo.lock"))?;
    let compilers = [compiler_of_host()?, compiler_of_images()?];
    for (product, is_image) in PRODUCTS {
        let platform = if is_image { TRIPLE } else { env!("XTASK_HOST") };
        let metadata = Metadata::of(platform).map_err(|error| anyhow!(error))?;
        let bill = bill(product, platform, &metadata, &lock, &compilers[usize::from(is_image)])?;
        let path = flags.out.join(format!("{product}.cdx.json"));
        fs::write(&path, format!("{bill:#}\n"))
            .with_context(|| format!("cannot write {}", path.display()))?;
        println!("{}", path.display());
    }
    Ok(())
}

/// The compiler of the programs for this machine: the output of `rustc -vV`.
fn compiler_of_host() -> Result<String> {
    start::output("rustc", &["-vV"]).context("rustc does not tell its version")
}

/// The compiler of the images, which may be another one.
fn compiler_of_images() -> Result<String> {
    match Toolchain::ensure()? {
        Toolchain::Installed => compiler_of_host(),
        Toolchain::Debian { .. } => {
            start::output("/usr/bin/rustc", &["-vV"]).context("rustc does not tell its version")
        }
    }
}

fn bill(product: &str, platform: &str, metadata: &Metadata, lock: &str, compiler: &str) -> Result<Json> {
    let linked = metadata.linked(product).with_context(|| format!("{product} is no package"))?;
    let checksums = checksums(lock);
    let names: HashMap<&str, String> =
        linked.iter().map(|package| (package.id.as_str(), purl(package))).collect();
    let (own, others): (Vec<&Package>, Vec<&Package>) =
        linked.iter().partition(|package| package.name == product && package.source.is_none());
    let own = own.first().context("the product is linked into itself")?;
    let mut components = Vec::new();
    for package in others {
        components.push(component(package, &checksums)?);
    }
    components.sort_by_key(|component| component["bom-ref"].to_string());
    let mut dependencies: Vec<Json> =
        linked.iter().map(|package| depends(package, metadata, &names)).collect();
    dependencies.sort_by_key(|dependency| dependency["ref"].to_string());
    let word = |name: &str| compiler.lines().find_map(|line| line.strip_prefix(name)).map(str::trim);
    Ok(json!({
        "bomFormat": "CycloneDX", "specVersion": "1.5", "version": 1,
        "metadata": {
            "component": {
                "type": if platform == TRIPLE { "firmware" } else { "application" }, "bom-ref": purl(own),
                "name": product, "version": own.version, "purl": purl(own),
                "licenses": licences(own),
            },
            "tools": { "components": [{
                "type": "application", "name": "rustc", "version": word("release:"),
                "properties": [
                    { "name": "commit-hash", "value": word("commit-hash:") },
                    { "name": "LLVM version", "value": word("LLVM version:") },
                    { "name": "target", "value": platform },
                ],
            }] },
        },
        "components": components,
        "dependencies": dependencies,
    }))
}

fn component(package: &Package, checksums: &HashMap<(&str, &str), &str>) -> Result<Json> {
    let mut component = json!({
        "type": "library", "bom-ref": purl(package), "name": package.name, "version": package.version,
        "purl": purl(package), "licenses": licences(package),
    });
    if package.source.is_some() {
        let checksum = checksums.get(&(package.name.as_str(), package.version.as_str()));
        ensure!(checksum.is_some(), "{} has no checksum in Cargo.lock", package.name);
        component["hashes"] = json!([{ "alg": "SHA-256", "content": checksum }]);
    }
    Ok(component)
}

fn depends(package: &Package, metadata: &Metadata, names: &HashMap<&str, String>) -> Json {
    let mut on: Vec<&String> = metadata.linked_into(&package.id).filter_map(|id| names.get(id)).collect();
    on.sort();
    json!({ "ref": purl(package), "dependsOn": on })
}

fn licences(package: &Package) -> Json {
    // A slash is an old form of OR.
    let expression = package.license.as_deref().map(|licence| licence.replace('/', " OR "));
    expression.map_or(json!([]), |expression| json!([{ "expression": expression }]))
}

/// The address of a package. Packages of the workspace are in no registry.
fn purl(package: &Package) -> String {
    let place = if package.source.is_some() { "cargo" } else { "generic" };
    format!("pkg:{place}/{}@{}", package.name, package.version)
}

/// The SHA-256 of each package of a registry, by name and version.
fn checksums(lock: &str) -> HashMap<(&str, &str), &str> {
    let entries = lock.split("[[package]]").skip(1);
    let entry = |entry| Some(((value(entry, "name")?, value(entry, "version")?), value(entry, "checksum")?));
    entries.filter_map(entry).collect()
}

/// The text of a key in an entry of Cargo.lock.
fn value<'a>(entry: &'a str, key: &str) -> Option<&'a str> {
    let line = entry.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(" = \""))?;
    line.strip_suffix('"')
}

#[cfg(test)]
mod tests {
    use super::*;

    const COMPILER: &str = "rustc 1.95.0 (f2d3ce0bd 2026-03-21)\nbinary: rustc\ncommit-hash: f2d3\nrelease: 1.95.0\nLLVM version: 22.1\n";

    fn of(product: &str, platform: &str) -> Json {
        let metadata = Metadata::of(platform).unwrap();
        let lock = fs::read_to_string(root().join("Cargo.lock")).unwrap();
        bill(product, platform, &metadata, &lock, COMPILER).unwrap()
    }

    #[test]
    fn a_bill_names_each_linked_package_with_its_checksum_and_the_compiler() {
        for (product, is_image) in PRODUCTS {
            let platform = if is_image { TRIPLE } else { env!("XTASK_HOST") };
            let bill = of(product, platform);
            let names = |name: &str| {
                bill["components"].as_array().unwrap().iter().filter(|one| one["name"] == name).count()
            };
            assert_eq!(
                (names("canopen-device"), names(product), names("zencan-node")),
                (1, 0, 0),
                "{product}"
            );
            assert_eq!(names("salty"), 1, "{product}: what checks signatures");
            assert_eq!(names("serde_json"), usize::from(product == "nodectl"), "{product}");
            for component in bill["components"].as_array().unwrap() {
                let is_own = component["purl"].as_str().unwrap().starts_with("pkg:generic/");
                let hash = component["hashes"][0]["content"].as_str().unwrap_or_default();
                assert_eq!(hash.len(), if is_own { 0 } else { 64 }, "{component}");
            }
            let compiler = &bill["metadata"]["tools"]["components"][0];
            assert_eq!(
                (&compiler["version"], &compiler["properties"][0]["value"]),
                (&"1.95.0".into(), &"f2d3".into())
            );
            assert_eq!(bill, of(product, platform), "nothing in it depends on the time");
        }
    }

    #[test]
    fn every_dependency_of_a_bill_is_a_component_of_it() {
        let bill = of("firmware", TRIPLE);
        let known: Vec<&Json> =
            bill["components"].as_array().unwrap().iter().map(|one| &one["bom-ref"]).collect();
        for dependency in bill["dependencies"].as_array().unwrap() {
            for on in dependency["dependsOn"].as_array().unwrap() {
                assert!(known.contains(&on), "{on}");
            }
        }
    }
}
