//! All points of a scene, or some of them.

use std::collections::BTreeMap;
use std::thread;

use anyhow::{Result, anyhow, ensure};
use emulator::Point;
use fastrand::Rng;

use crate::rig::{Fault, Outcome, Rig};
use crate::scene::Scene;

/// How much is tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Extent {
    /// Every so many instructions is a point: 1 takes all.
    pub every: usize,
    /// The same of those that run more often than [`OFTEN`].
    pub every_of_loops: usize,
    /// So many bits of registers are flipped at each point, one after the other.
    pub flips: usize,
    /// Threads, each with a board of its own.
    pub boards: usize,
}

/// What a campaign asks and tells meanwhile.
pub struct Watcher<'a> {
    /// Whether the instruction at this address is to be disturbed.
    pub takes: &'a (dyn Fn(u32) -> bool + Sync),
    /// A fault has made run what may not.
    pub broken: &'a (dyn Fn(Violation) + Sync),
}

/// What runs more often is a loop of the hashes, of the sums, or of the arithmetic of points: wrong there is the number, not the
/// decision.
pub const OFTEN: u64 = 66;

/// A fault that made run what may not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Violation {
    /// Where.
    pub point: Point,
    /// What.
    pub fault: Fault,
}

/// What was tried, and what came of it.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    /// Instructions that the decision has.
    pub instructions: usize,
    /// Those of them that run more often than [`OFTEN`].
    pub loops: usize,
    /// Points at which the program was stopped.
    pub points: usize,
    /// Skips and flips, by what came of them.
    pub outcomes: BTreeMap<(&'static str, &'static str), usize>,
    /// The faults that made run what may not.
    pub violations: Vec<Violation>,
}

impl Campaign {
    /// Disturbs the decision of a scene.
    ///
    /// # Errors
    /// The image is none for the board, or the decision is wrong without any fault.
    pub fn run(bootloader: &[u8], scene: &Scene, extent: Extent, watcher: &Watcher<'_>) -> Result<Campaign> {
        let mut rig = Rig::new(bootloader)?;
        let (visits, outcome) = rig.survey(scene)?;
        let expected = if scene.has_good { Outcome::Good } else { Outcome::Stays };
        ensure!(outcome == expected, "{}: without a fault the outcome is {outcome:?}", scene.name);
        let undisturbed = rig.undisturbed;
        let (loops, rest): (Vec<&Point>, Vec<&Point>) = visits.iter().partition(|point| point.visit > OFTEN);
        let chosen = rest
            .into_iter()
            .step_by(extent.every)
            .chain(loops.iter().copied().step_by(extent.every_of_loops));
        let chosen: Vec<Point> = chosen.flat_map(ends).collect();
        let shares = chosen.chunks(chosen.len().div_ceil(extent.boards.max(1)).max(1));
        let parts: Vec<Result<Campaign>> = thread::scope(|scope| {
            let boards: Vec<_> = shares
                .map(|share| {
                    scope.spawn(|| part(bootloader, scene, share, extent.flips, &undisturbed, watcher))
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

    /// Faults that were tried.
    #[must_use]
    pub fn faults(&self) -> usize {
        self.outcomes.values().sum()
    }

    fn add(&mut self, part: Campaign) {
        self.points += part.points;
        self.violations.extend(part.violations);
        for (kind, count) in part.outcomes {
            *self.outcomes.entry(kind).or_default() += count;
        }
    }

    fn note(&mut self, point: Point, fault: Fault, outcome: Outcome) {
        let kind = match fault {
            Fault::Skip(..) => "skips",
            Fault::Flip(..) => "flips",
        };
        let what = match outcome {
            Outcome::Broken => "broken",
            Outcome::Good => "the good application runs",
            Outcome::Stays => "the bootloader stays",
            Outcome::Nothing => "neither within 8 s",
        };
        *self.outcomes.entry((kind, what)).or_default() += 1;
        if outcome == Outcome::Broken {
            self.violations.push(Violation { point, fault });
        }
    }
}

/// The first visit of an instruction and the last: what a loop does between is like the one or the other.
fn ends(last: &Point) -> impl Iterator<Item = Point> + use<> {
    let first = Point { visit: 1, ..*last };
    [first].into_iter().chain((last.visit > 1).then_some(*last))
}

/// What one board does: it runs once, from point to point.
fn part(
    bootloader: &[u8],
    scene: &Scene,
    points: &[Point],
    flips: usize,
    undisturbed: &[u8],
    watcher: &Watcher<'_>,
) -> Result<Campaign> {
    let mut campaign = Campaign::default();
    let mut rig = Rig::new(bootloader)?;
    rig.undisturbed = undisturbed.to_vec();
    rig.start(scene, points.to_vec())?;
    while let Some(point) = rig.next(scene.has_good)? {
        let moment = rig.stop()?;
        campaign.points += 1;
        for fault in rig.skips().into_iter().chain(some_flips(point, flips)) {
            let outcome = rig.disturb(fault, scene.has_good)?;
            campaign.note(point, fault, outcome);
            if outcome == Outcome::Broken {
                (watcher.broken)(Violation { point, fault });
            }
            rig.go_back(&moment)?;
        }
    }
    Ok(campaign)
}

/// Bits of R0 to R14, each of them at most once: those of a point are the same in every run.
fn some_flips(point: Point, flips: usize) -> Vec<Fault> {
    const REGISTERS: usize = 15;
    const BITS: usize = 32;
    let mut random = Rng::with_seed(u64::from(point.address) << 32 ^ point.visit);
    let chosen = random.choose_multiple(0..REGISTERS * BITS, flips);
    chosen.into_iter().map(|at| Fault::Flip((at / BITS) as u8, (at % BITS) as u8)).collect()
}
