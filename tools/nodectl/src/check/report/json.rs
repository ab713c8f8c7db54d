//! Report as JSON.

use serde_json::{Value, json};

use super::frames;
use crate::check::{Result, Run};

/// The whole run: the numbers, and each check with its verdict.
#[must_use]
pub fn json(run: &Run) -> Value {
    json!({
        "node": run.node.get(),
        "passed": run.count("passed"),
        "failed": run.count("failed"),
        "recommended": run.count("recommended"),
        "skipped": run.count("skipped"),
        "left_behind": run.left_behind,
        "checks": run.results.iter().map(check).collect::<Vec<Value>>(),
    })
}

fn check(result: &Result) -> Value {
    let deviation = result.verdict.deviation();
    let reason =
        if let crate::check::Verdict::Skipped(reason) = &result.verdict { Some(reason) } else { None };
    json!({
        "id": result.check.id,
        "title": result.check.title,
        "clause": result.check.clause,
        "verdict": result.verdict.word(),
        "expected": deviation.map(|deviation| &deviation.expected),
        "seen": deviation.map(|deviation| &deviation.seen),
        "reason": reason,
        "milliseconds": result.time.0 / 1000,
        "frames": frames::lines(&result.frames),
    })
}
