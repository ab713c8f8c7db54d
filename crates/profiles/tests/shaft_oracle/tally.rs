//! The counts of the judge.

use std::collections::BTreeMap;

/// How the last run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Reset {
    /// NMT reset node, or the watchdog.
    Warm,
    /// A loss of power, with a battery.
    Battery,
    /// A loss of power, without a battery.
    NoBattery,
}

/// Counts of one sensor type and kind of reset.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub(crate) resets: u32,
    /// Samples with a wrong position that says it is right.
    pub(crate) wrong_as_right: u32,
    /// Starts at which a position was condemned, and those of them at which the position was right.
    pub(crate) condemned: u32,
    pub(crate) condemned_right: u32,
}

#[derive(Debug, Default)]
pub(crate) struct Tally {
    pub(crate) rows: BTreeMap<(u8, Reset), Row>,
    /// The first wrong positions.
    pub(crate) examples: Vec<String>,
    /// Positions that were not believed after a preset, or after a request where the code of the sensor is enough.
    pub(crate) stuck: Vec<String>,
}

impl Tally {
    pub(crate) fn row(&mut self, kind: u8, reset: Reset) -> &mut Row {
        self.rows.entry((kind, reset)).or_default()
    }

    pub(crate) fn add(&mut self, other: Tally) {
        for (key, row) in other.rows {
            let sum = self.rows.entry(key).or_default();
            sum.resets += row.resets;
            sum.wrong_as_right += row.wrong_as_right;
            sum.condemned += row.condemned;
            sum.condemned_right += row.condemned_right;
        }
        self.examples.extend(other.examples);
        self.stuck.extend(other.stuck);
    }

    pub(crate) fn print(&self) {
        println!("| type | reset | resets | wrong as right | condemned | of these right |");
        println!("|---|---|---|---|---|---|");
        for ((kind, reset), row) in &self.rows {
            let Row { resets, wrong_as_right, condemned, condemned_right } = row;
            println!(
                "| {kind} | {reset:?} | {resets} | {wrong_as_right} | {condemned} | {condemned_right} |"
            );
        }
        let resets: u32 = self.rows.values().map(|row| row.resets).sum();
        println!("{resets} resets");
    }

    pub(crate) fn assert_good(&self) {
        let wrong: u32 = self.rows.values().map(|row| row.wrong_as_right).sum();
        assert_eq!(wrong, 0, "wrong positions shown as right: {:#?}", self.examples);
        assert!(self.stuck.is_empty(), "positions that stay condemned: {:#?}", self.stuck);
    }
}
