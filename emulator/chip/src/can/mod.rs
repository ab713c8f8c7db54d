//! bxCAN at register level (RM0390 and RM0090, chapter bxCAN).

mod bxcan;
mod controller;
mod dual;
mod fifo;
mod filter;
mod mailbox;
mod status;
mod transmit;

pub use bxcan::{BxCan, Lines, Reception};
pub use dual::DualCan;
