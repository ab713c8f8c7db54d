//! Steps 14 and 15: saves and updates.

use anyhow::{Context as _, Result};
use canopen::nmt::Command;
use canopen::{Duration, Frame};
use nodectl::nmt;
use nodectl::sdo;
use nodectl::update::{Options, Step, Watcher, update as update_nodes};

use super::sensors::lost_events;
use crate::bench::{Bench, SELF_TEST};
use crate::values::{self, COMMANDS};

/// A value without effect on the measurement: the heartbeat time.
const SAVED: (u16, u8) = (0x1017, 0);
const SAVE: (u16, u8) = (0x1010, 2);
/// The free part of the stack beside its bound in bytes (`cargo xtask stack`), rounded down.
const FREE_STACK: u32 = 2000;
/// The longest erase of 16 KiB in microseconds (STM32F446 datasheet, flash memory programming).
const LONGEST_ERASE: u32 = 500_000;
/// The time after a start at which a crash no longer counts, and some more.
const FORGIVEN: Duration = Duration::from_millis(11_000);

pub(super) fn saves(bench: &mut Bench<'_>) -> Result<()> {
    let node = bench.node;
    let mut value = 500;
    for _ in 0..bench.effort.times {
        value += 1;
        load(bench)?;
        bench.set(SAVED.0, SAVED.1, &u16::to_le_bytes(value))?;
        load(bench)?;
        bench.set(SAVE.0, SAVE.1, b"save")?;
    }
    stack(bench)?;
    nmt::send(bench.desk.network(), Command::ResetNode, Some(node))?;
    bench.wait(Duration::from_millis(2000))?;
    let found = bench.object(SAVED.0, SAVED.1)? & 0xFFFF;
    bench.check(
        "the saved value after a reset",
        found,
        value,
        found == u32::from(value),
        "Read the log for \"not stored\", 2001h:8 and 2001h:10",
    );
    let erase = bench.self_test(values::LONGEST_ERASE)?;
    bench.check(
        "longest erase of a parameter page (2005h)",
        format!("{erase} us"),
        "500000 us at most; 0 in a release, and when no page was erased",
        erase <= LONGEST_ERASE,
        "The flash is slower than its data sheet: a low supply, or a chip at the end of its life",
    );
    lost_events(bench)
}

/// The stack that neither the load nor the saves have used.
fn stack(bench: &mut Bench<'_>) -> Result<()> {
    const WHAT: &str = "unused stack (2005h)";
    if let Some(bytes) = bench.start_test(WHAT, values::FREE_STACK)? {
        bench.check(
            WHAT,
            format!("{bytes} bytes"),
            format!("{FREE_STACK} bytes at least"),
            bytes >= FREE_STACK,
            "Deeper than `cargo xtask stack` computes: report it with the log",
        );
    }
    Ok(())
}

/// SYNCs in a row: the receive FIFO of the node is full, and its TPDOs load the bus.
fn load(bench: &mut Bench<'_>) -> Result<()> {
    let sync = Frame::new(0x080, &[]).context("a SYNC")?;
    (0..20).try_for_each(|_| Ok(bench.desk.network().send(&sync)?))
}

pub(super) fn update(bench: &mut Bench<'_>) -> Result<()> {
    let image = bench.desk.image().clone();
    let options = Options {
        sdo: sdo::Options::default(),
        patience: Duration::from_millis(30_000),
        force: true,
        key: None,
        confirm: true,
    };
    for number in 1..=2 {
        let node = bench.node;
        let results = update_nodes(bench.desk.network(), &[node], &image, &options, &mut Silent);
        let seen = results.into_iter().next().map(|(_, result)| result.map(drop));
        let text = match &seen {
            Some(Ok(())) => "the new program runs".to_owned(),
            Some(Err(error)) => error.to_string(),
            None => "nothing".to_owned(),
        };
        bench.check(
            &format!("update {number}"),
            &text,
            "the new program runs",
            matches!(seen, Some(Ok(()))),
            "The bootloader keeps the old program: `nodectl info` shows which one runs; see docs/update.md",
        );
    }
    lost_events(bench)?;
    crashes(bench)
}

/// A program that hangs, faults, overflows its stack or panics starts again, and its log names the end of the last run.
fn crashes(bench: &mut Bench<'_>) -> Result<()> {
    for (command, what, words) in COMMANDS {
        // Until the last crash is forgiven: the third one in a row would keep the bootloader.
        bench.wait(FORGIVEN)?;
        bench.desk.log(Duration::from_millis(10))?;
        bench.set(SELF_TEST, 0, &values::selection(command))?;
        if bench.object(SELF_TEST, 0).is_ok() {
            bench.remark(what, "ignored", words, "The images are no development images");
            return Ok(());
        }
        bench.answers_within(Duration::from_millis(5000))?;
        let lines = bench.desk.log(Duration::from_millis(100))?;
        let seen = lines.iter().find(|line| line.contains(words));
        bench.check(
            &format!("the log after a {what}"),
            seen.map_or("nothing", String::as_str),
            words,
            seen.is_some(),
            "The record in RAM is lost: the supply has failed at the reset, or a debugger has cleared the RAM",
        );
    }
    Ok(())
}

/// The progress is not shown.
struct Silent;

impl Watcher for Silent {
    fn step(&mut self, _: canopen::NodeId, _: Step) {}

    fn progress(&mut self, _: canopen::NodeId, _: usize, _: usize) {}
}
