//! Checks of synchronisation (CiA 301, 7.2.5).

mod objects;
mod producer;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[objects::CHECKS, producer::CHECKS];
