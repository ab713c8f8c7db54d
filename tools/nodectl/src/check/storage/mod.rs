//! Checks of saving and restoring parameters (CiA 301, 7.5.2.13 and 7.5.2.14).

mod restore;
mod save;
mod signature;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[signature::CHECKS, save::CHECKS, restore::CHECKS];
