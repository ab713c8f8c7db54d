//! bxCAN as its driver and the bus see it.

mod filters;
mod modes;
mod receive;
mod rig;
mod transmit;
