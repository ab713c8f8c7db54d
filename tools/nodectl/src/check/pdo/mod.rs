//! Checks of process data objects (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38).

mod content;
mod mapping;
mod objects;
mod rpdo;
mod silence;
mod transmission;

use super::Check;

pub(super) const CHECKS: &[&[Check]] =
    &[objects::CHECKS, transmission::CHECKS, silence::CHECKS, mapping::CHECKS, content::CHECKS, rpdo::CHECKS];
