//! Checks of error control: heartbeat and node guarding (CiA 301, 7.2.8.2.2).

mod consumer;
mod guarding;
mod producer;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[producer::CHECKS, consumer::CHECKS, guarding::CHECKS];
