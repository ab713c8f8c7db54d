//! The tasks of the images and their priorities. They come from the source, because the ELF file does not tell them.

use std::collections::BTreeMap;

use anyhow::{Context, Result, bail};

const FIRMWARE: &str = include_str!("../../../firmware/src/main.rs");
const BOOTLOADER: &str = include_str!("../../../bootloader/src/main.rs");

/// Interrupt handlers with RTIC's priorities. A higher number interrupts a lower one.
pub(crate) fn of(image: &str) -> Result<BTreeMap<&'static str, u8>> {
    match image {
        "firmware" => parse(FIRMWARE),
        "bootloader" => parse(BOOTLOADER),
        other => bail!("no image {other}"),
    }
}

/// Reads each `#[task(binds = NAME, priority = NUMBER, ...`.
fn parse(source: &str) -> Result<BTreeMap<&str, u8>> {
    let attributes = source.split("#[task(").skip(1);
    let task = |attribute| value(attribute, "binds").zip(value(attribute, "priority")?.parse().ok());
    attributes
        .map(|attribute| task(attribute).with_context(|| format!("not a task: {attribute:.60}")))
        .collect()
}

fn value<'a>(attribute: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = attribute.split_once(key)?;
    rest.trim_start_matches([' ', '=']).split([',', ' ', ')']).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_has_its_priority() {
        let source =
            "#[task(binds = TIM2, priority = 3, local = [a])] fn a() {}\n#[task(binds = SDIO, priority = 1)]";
        assert_eq!(parse(source).unwrap(), BTreeMap::from([("TIM2", 3), ("SDIO", 1)]));
        assert!(parse("#[task(binds = TIM2)]").is_err());
    }

    #[test]
    fn both_images_have_tasks() {
        assert_eq!(of("firmware").unwrap().len(), 7);
        assert_eq!(of("bootloader").unwrap().len(), 3);
    }
}
