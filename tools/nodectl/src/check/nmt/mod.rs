//! Checks of network management and boot-up (CiA 301, 7.3.2).

mod addressing;
mod boot;
mod states;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[boot::CHECKS, states::CHECKS, addressing::CHECKS];
