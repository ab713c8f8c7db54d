//! The data sheet, and the dictionary of the device against it.

mod against;
mod sheet;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[sheet::CHECKS, against::CHECKS];
