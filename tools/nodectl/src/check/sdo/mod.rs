//! Checks of service data objects (CiA 301, 7.2.4).

mod block;
mod expedited;
mod segmented;
mod servers;

use super::Check;

pub(super) const CHECKS: &[&[Check]] =
    &[expedited::CHECKS, segmented::CHECKS, block::CHECKS, servers::CHECKS];
