//! Checks of the data sheet, and of the device's dictionary against it.

mod against;
mod sheet;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[sheet::CHECKS, against::CHECKS];
