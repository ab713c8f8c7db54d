//! Steps 14 and 15: saves and updates.

use anyhow::{Context as _, Result};
use canopen::nmt::Command;
use canopen::{Duration, Frame};
use nodectl::nmt;
use nodectl::sdo;
use nodectl::update::{Options, Step, Watcher, update as update_nodes};

use super::sensors::lost_events;
use crate::bench::Bench;

/// A value without effect on the measurement: the heartbeat time.
const SAVED: (u16, u8) = (0x1017, 0);
const SAVE: (u16, u8) = (0x1010, 2);

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
    lost_events(bench)
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
    lost_events(bench)
}

/// Nobody watches the progress.
struct Silent;

impl Watcher for Silent {
    fn step(&mut self, _: canopen::NodeId, _: Step) {}

    fn progress(&mut self, _: canopen::NodeId, _: usize, _: usize) {}
}
