//! Injects faults at the points of a scene, or at a sample of them.

use std::collections::{BTreeMap, HashSet};
use std::thread;

use anyhow::{Result, anyhow, ensure};
use emulator::Point;

use crate::glitch::choice;
use crate::glitch::fault::Fault;
use crate::glitch::reads::{Decoder, Reads};
use crate::glitch::rig::{Outcome, Rig};
use crate::glitch::scene::Scene;

/// The share of points and faults that a campaign injects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Sampling interval of instructions: 1 selects each.
    pub every: usize,
    /// Sampling interval of instructions that read condition flags.
    pub every_of_conditions: usize,
    /// Sampling interval of instructions that run more often than [`OFTEN`].
    pub every_of_loops: usize,
    /// Number of register bits that are flipped at each point, one after the other.
    pub flips: usize,
    /// Sampling interval of both instructions of pairs of skips, outside of loops; without it, one fault at a time.
    pub pairs: Option<usize>,
    /// Number of threads, each with its own board.
    pub boards: usize,
}

/// Callbacks of a running campaign.
pub struct Watcher<'a> {
    /// Returns whether faults are injected into the instruction at this address.
    pub takes: &'a (dyn Fn(u32) -> bool + Sync),
    /// Receives each fault that made the bootloader start a forbidden image.
    pub broken: &'a (dyn Fn(Violation) + Sync),
}

/// Instructions that run more often belong to loops of the hash, of a CRC, or of the curve arithmetic: a fault there changes a
/// number, and rarely the decision.
pub const OFTEN: u64 = 66;

/// A fault that made the bootloader start a forbidden image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// The instruction, with the number of its visit.
    pub point: Point,
    /// The injected fault.
    pub fault: Fault,
    /// The skip before it, of a pair.
    pub after: Option<Fault>,
}

/// Injected faults and their outcomes.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    /// Number of instructions in the decision.
    pub instructions: usize,
    /// Number of instructions that run more often than [`OFTEN`].
    pub loops: usize,
    /// Number of points at which faults were injected.
    pub points: usize,
    /// Number of register bits that are read at these points, flipped or not.
    pub bits: usize,
    /// Number of faults by kind and outcome.
    pub outcomes: BTreeMap<(&'static str, &'static str), usize>,
    /// Faults that made the bootloader start a forbidden image.
    pub violations: Vec<Violation>,
}

impl Campaign {
    /// Injects faults into the decision of a scene.
    ///
    /// # Errors
    /// The file is not an image for the board, or the decision without a fault is wrong.
    pub fn run(bootloader: &[u8], scene: &Scene, extent: Extent, watcher: &Watcher<'_>) -> Result<Campaign> {
        let mut rig = Rig::new(bootloader)?;
        let (visits, outcome) = rig.survey(scene)?;
        let expected = if scene.has_good { Outcome::Good } else { Outcome::Stays };
        ensure!(outcome == expected, "{}: without a fault the outcome is {outcome:?}", scene.name);
        let visits: Vec<Point> = visits.into_iter().filter(|point| (watcher.takes)(point.address)).collect();
        let (loops, rest): (Vec<Point>, Vec<Point>) = visits.iter().partition(|point| point.visit > OFTEN);
        let seconds: Vec<Point> = rest.iter().map(|point| Point { visit: 1, ..*point }).collect();
        let conditions = conditions(&rig, &rest)?;
        let (conditions, rest): (Vec<Point>, Vec<Point>) =
            rest.iter().partition(|point| conditions.contains(&point.address));
        let chosen: Vec<Point> = if let Some(every) = extent.pairs {
            seconds.iter().copied().step_by(every).collect()
        } else {
            let chosen = rest
                .iter()
                .step_by(extent.every)
                .chain(conditions.iter().step_by(extent.every_of_conditions))
                .chain(loops.iter().step_by(extent.every_of_loops));
            chosen.flat_map(ends).collect()
        };
        let undisturbed = rig.undisturbed;
        let shares = chosen.chunks(chosen.len().div_ceil(extent.boards.max(1)).max(1));
        let parts: Vec<Result<Campaign>> = thread::scope(|scope| {
            let boards: Vec<_> = shares
                .map(|share| {
                    scope.spawn(|| match extent.pairs {
                        None => part(bootloader, scene, share, extent.flips, &undisturbed, watcher),
                        Some(_) => pairs(bootloader, scene, [share, &chosen], &undisturbed, watcher),
                    })
                })
                .collect();
            boards.into_iter().map(|board| board.join().map_err(|_| anyhow!("a board was lost"))?).collect()
        });
        let mut all = Campaign { instructions: visits.len(), loops: loops.len(), ..Campaign::default() };
        for part in parts {
            all.add(part?);
        }
        Ok(all)
    }

    /// Number of injected faults.
    #[must_use]
    pub fn faults(&self) -> usize {
        self.outcomes.values().sum()
    }

    /// Number of injected faults of a kind: "skips", "flags" or "register bits".
    #[must_use]
    pub fn tried(&self, kind: &str) -> usize {
        self.outcomes.iter().filter(|((of, _), _)| *of == kind).map(|(_, count)| count).sum()
    }

    fn add(&mut self, part: Campaign) {
        self.points += part.points;
        self.bits += part.bits;
        self.violations.extend(part.violations);
        for (kind, count) in part.outcomes {
            *self.outcomes.entry(kind).or_default() += count;
        }
    }

    fn note(&mut self, violation: Violation, outcome: Outcome, watcher: &Watcher<'_>) {
        let what = match outcome {
            Outcome::Broken => "broken",
            Outcome::Good => "the good application runs",
            Outcome::Stays => "the bootloader stays",
            Outcome::Nothing => "neither within 8 s",
        };
        let kind = if violation.after.is_some() { "pairs of skips" } else { violation.fault.kind() };
        *self.outcomes.entry((kind, what)).or_default() += 1;
        if outcome == Outcome::Broken {
            self.violations.push(violation);
            (watcher.broken)(violation);
        }
    }
}

/// The first and the last visit of an instruction; visits between them behave like one of the two.
fn ends(last: &Point) -> impl Iterator<Item = Point> + use<> {
    let first = Point { visit: 1, ..*last };
    [first].into_iter().chain((last.visit > 1).then_some(*last))
}

/// Instructions that read condition flags, and IT instructions of blocks that read them.
fn conditions(rig: &Rig, points: &[Point]) -> Result<HashSet<u32>> {
    let decoder = Decoder::new()?;
    let mut all = HashSet::new();
    for point in points {
        let reads = decoder.reads(point.address, &rig.code(point.address))?;
        if reads.iter().any(|reads| reads.flags) {
            all.insert(point.address);
        }
    }
    Ok(all)
}

/// The share of one board, which runs once from point to point.
fn part(
    bootloader: &[u8],
    scene: &Scene,
    points: &[Point],
    flips: usize,
    undisturbed: &[u8],
    watcher: &Watcher<'_>,
) -> Result<Campaign> {
    let mut campaign = Campaign::default();
    let decoder = Decoder::new()?;
    let mut rig = Rig::new(bootloader)?;
    rig.undisturbed = undisturbed.to_vec();
    rig.start(scene, points.to_vec())?;
    while let Some(point) = rig.next(scene.has_good)? {
        let moment = rig.stop()?;
        campaign.points += 1;
        let reads = decoder.reads(point.address, &rig.code(point.address))?;
        campaign.bits += reads.iter().map(choice::possible).sum::<usize>();
        for fault in rig.skips().into_iter().chain(wrong_reads(&reads, point, flips)) {
            let outcome = rig.disturb(fault, scene.has_good)?;
            campaign.note(Violation { point, fault, after: None }, outcome, watcher);
            rig.go_back(&moment)?;
        }
    }
    Ok(campaign)
}

/// The share of one board of pairs: each skip at one of the first points, followed by a skip at each of the others that the
/// program comes to afterwards, at the first visit.
fn pairs(
    bootloader: &[u8],
    scene: &Scene,
    [firsts, seconds]: [&[Point]; 2],
    undisturbed: &[u8],
    watcher: &Watcher<'_>,
) -> Result<Campaign> {
    let mut campaign = Campaign::default();
    let mut rig = Rig::new(bootloader)?;
    rig.undisturbed = undisturbed.to_vec();
    for first in firsts {
        rig.start(scene, vec![*first])?;
        if rig.next(scene.has_good)?.is_none() {
            continue;
        }
        let begin = rig.stop()?;
        for after in rig.skips() {
            rig.inject(after)?;
            rig.watch(seconds)?;
            while let Some(point) = rig.next(scene.has_good)? {
                let moment = rig.stop()?;
                campaign.points += 1;
                for fault in rig.skips() {
                    let outcome = rig.disturb(fault, scene.has_good)?;
                    campaign.note(Violation { point, fault, after: Some(after) }, outcome, watcher);
                    rig.go_back(&moment)?;
                }
            }
            rig.stop()?;
            rig.go_back(&begin)?;
        }
    }
    Ok(campaign)
}

/// Faults of the flags and registers that the instructions of a point read.
fn wrong_reads(reads: &[Reads], point: Point, flips: usize) -> Vec<Fault> {
    let of = |reads| [choice::flags(reads), choice::some_bits(reads, point.visit, flips)].concat();
    reads.iter().flat_map(of).collect()
}
