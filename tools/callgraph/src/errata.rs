//! Places in the code that errata forbid.

use std::collections::BTreeMap;

use anyhow::{Result, ensure};

use crate::code::{Decoder, Line};
use crate::image::Image;

/// Code at these addresses is read from flash.
const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0810_0000;

/// The forbidden places, one line each. An image without a WFI, or without a handler, is an error.
pub(crate) fn places(image: &Image<'_>, tasks: &BTreeMap<&str, u8>) -> Result<Vec<String>> {
    let decoder = Decoder::new()?;
    let (mut found, mut sleeps) = (Vec::new(), 0);
    for function in image.functions() {
        let lines = decoder.list(image, function)?;
        sleeps += lines.iter().filter(|line| is_sleep(line)).count();
        found.extend(unsafe_sleeps(&lines));
    }
    ensure!(sleeps > 0, "no WFI");
    for handler in tasks.keys() {
        let lines = decoder.list(image, image.function(handler)?)?;
        let returns = lines.iter().filter(|line| is_return(&lines, line)).count();
        ensure!(returns > 0, "{handler} does not return");
        found.extend(unsafe_returns(&lines).map(|at| format!("{at:#010x}: {handler} returns after a store")));
    }
    Ok(found)
}

fn is_sleep(line: &Line) -> bool {
    line.mnemonic.starts_with("wfi") || line.mnemonic.starts_with("wfe")
}

/// Debugging Sleep/Stop mode with WFI/WFE entry (ES0298, ES0182): in flash, WFI needs an address that is a multiple of
/// eight, with ISB behind it.
fn unsafe_sleeps(lines: &[Line]) -> impl Iterator<Item = String> {
    let next = lines.iter().skip(1).map(Some).chain([None]);
    lines.iter().zip(next).filter(|(line, _)| is_sleep(line) && FLASH.contains(&line.at)).filter_map(
        |(line, next)| {
            let has_barrier = next.is_some_and(|next| next.mnemonic == "isb");
            let is_safe = line.at.is_multiple_of(8) && has_barrier;
            (!is_safe).then(|| format!("{:#010x}: {} in flash", line.at, line.mnemonic))
        },
    )
}

/// A return, or a jump to the end of a function that the compiler shares: a series of pops.
fn is_return(lines: &[Line], line: &Line) -> bool {
    let jumps = matches!(line.mnemonic.as_str(), "b" | "b.w");
    let target = line.operands.trim_start_matches("#0x");
    let leaves = || {
        let target = u32::from_str_radix(target, 16).unwrap_or_default();
        let [first, last] = [lines.first(), lines.last()].map(|line| line.map_or(0, |line| line.at));
        !(first..=last).contains(&target)
    };
    line.mnemonic.starts_with("pop") && line.operands.contains("pc")
        || line.mnemonic.starts_with("bx") && line.operands == "lr"
        || jumps && leaves()
}

/// Erratum 838869 of the Cortex-M4: a return needs DSB behind the last store. The addresses of returns without one.
fn unsafe_returns(lines: &[Line]) -> impl Iterator<Item = u32> {
    let returns = lines.iter().enumerate().filter(|(_, line)| is_return(lines, line));
    returns.filter_map(|(number, line)| {
        let before = lines.iter().take(number).rev();
        let last = before.into_iter().find(|line| line.mnemonic == "dsb" || is_store(line));
        last.is_none_or(|last| last.mnemonic != "dsb").then_some(line.at)
    })
}

fn is_store(line: &Line) -> bool {
    ["str", "stm", "vstr", "vstm"].iter().any(|store| line.mnemonic.starts_with(store))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn code(start: u32, text: &[(&str, &str)]) -> Vec<Line> {
        let line = |(number, (mnemonic, operands)): (u32, &(&str, &str))| Line {
            at: start + 2 * number,
            mnemonic: (*mnemonic).to_owned(),
            operands: (*operands).to_owned(),
        };
        (0..).zip(text).map(line).collect()
    }

    #[test]
    fn a_sleep_in_flash_needs_its_address_and_its_barrier() {
        let unsafe_at = |start, text: &[(&str, &str)]| unsafe_sleeps(&code(start, text)).count();
        let (sleep, barrier) = (("wfi", ""), ("isb", "sy"));
        assert_eq!(unsafe_at(0x0802_0208, &[sleep, barrier]), 0);
        assert_eq!(unsafe_at(0x0802_020C, &[sleep, barrier]), 1);
        assert_eq!(unsafe_at(0x0802_0208, &[sleep, ("bx", "lr")]), 1);
        assert_eq!(unsafe_at(0x0802_0208, &[sleep]), 1);
        assert_eq!(unsafe_at(0x2000_600C, &[sleep]), 0);
    }

    #[test]
    fn a_return_needs_a_barrier_behind_the_last_store() {
        let unsafe_at = |text: &[(&str, &str)]| unsafe_returns(&code(0, text)).count();
        let (store, barrier, end) = (("str", "r0, [r1]"), ("dsb", "sy"), ("pop", "{r4, pc}"));
        assert_eq!(unsafe_at(&[store, barrier, ("msr", "basepri, r0"), end]), 0);
        assert_eq!(unsafe_at(&[barrier, store, end]), 1);
        assert_eq!(unsafe_at(&[store, ("bx", "lr")]), 1);
        assert_eq!(unsafe_at(&[store, ("b", "#0x2"), ("b.w", "#0x8000")]), 1);
        assert_eq!(unsafe_at(&[store, barrier, end, store, end]), 1);
    }
}
