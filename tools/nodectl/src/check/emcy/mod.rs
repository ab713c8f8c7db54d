//! Checks of emergencies (CiA 301, 7.2.7 and 7.5.2.2 to 7.5.2.17).

mod list;
mod message;
mod objects;
mod provoke;

use super::Check;

pub(super) const CHECKS: &[&[Check]] = &[objects::CHECKS, message::CHECKS, list::CHECKS];
