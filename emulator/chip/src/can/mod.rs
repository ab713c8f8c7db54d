//! bxCAN at register level (RM0390 and RM0090, chapter bxCAN).

mod bxcan;
mod controller;
mod dual;

pub use bxcan::{BxCan, Lines, Reception};
pub use dual::DualCan;
