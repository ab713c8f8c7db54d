//! Foreign traffic, nonsense and floods: the device stays as it is.

mod floods;
mod foreign;
mod nonsense;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[foreign::CHECKS, nonsense::CHECKS, floods::CHECKS];
