//! Checks with foreign traffic, nonsense and floods, which must not change the device.

mod floods;
mod foreign;
mod nonsense;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[foreign::CHECKS, nonsense::CHECKS, floods::CHECKS];
